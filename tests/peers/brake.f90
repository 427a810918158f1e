! The smoothed brake for AUTO-07p (docs/equations.md, "One inertia with one brake"), with
! F_a >= 0 (release):
!
!   J theta'' + c theta' + k theta + R F_a(theta') g(m(R theta')) = T_e sin(omega t)
!
! Time in units of 1/omega, so that a period of the torque is 2 pi, and both unknowns in
! rad/s: u(1) = omega theta, u(2) = theta'. u(3), u(4) = sin, cos of the torque's phase, from
! an oscillator whose limit cycle is the unit circle. Parameters: par(1) = eta, which sets the
! slope of the actuation force, and par(2) = F0, which sets T_e. The file brake.txt holds the
! numbers: SI units, eta and F0 of the first orbit last.

module brake
  implicit none
  double precision :: inertia, damping, stiffness, radius, force, mu, static, decay, steepness
  double precision :: omega, tangent, start(2)
  logical :: known = .false.
contains

  subroutine read_numbers
    integer :: unit
    if (known) return
    open (newunit=unit, file='brake.txt', status='old', action='read')
    read (unit, *) inertia, damping, stiffness, radius, force, mu, static, decay, steepness, &
      omega, tangent, start
    close (unit)
    known = .true.
  end subroutine

  ! R F_a g(m) and its derivative by theta'. tangent = tan(alpha_w); 0 for g(m) = m.
  subroutine brake_torque(velocity, slope, torque, rate)
    double precision, intent(in) :: velocity, slope
    double precision, intent(out) :: torque, rate
    double precision :: speed, side, peak, layer, m, dm, g, dg, press, dpress
    speed = radius * velocity
    side = sign(1d0, velocity)
    peak = (static - mu) * exp(-decay * abs(speed))
    layer = tanh(steepness * speed)
    m = (mu + peak) * layer
    dm = (mu + peak) * steepness * (1d0 - layer**2) - side * decay * peak * layer
    if (tangent > 0d0) then
      g = m / (tangent - m)
      dg = tangent / (tangent - m)**2
    else
      g = m
      dg = 1d0
    end if
    press = force + slope * abs(velocity)
    dpress = slope * side
    if (press < 0d0) then
      press = 0d0
      dpress = 0d0
    end if
    torque = radius * press * g
    rate = radius * (dpress * g + press * dg * dm * radius)
  end subroutine

end module

subroutine func(ndim, u, icp, par, ijac, f, dfdu, dfdp)
  use brake
  implicit none
  integer, intent(in) :: ndim, icp(*), ijac
  double precision, intent(in) :: u(ndim), par(*)
  double precision, intent(out) :: f(ndim)
  double precision, intent(inout) :: dfdu(ndim, ndim), dfdp(ndim, *)
  double precision :: slope, amplitude, torque, rate, square
  call read_numbers
  slope = par(1) * damping / (radius * mu)
  amplitude = force * mu * radius / par(2)
  call brake_torque(u(2), slope, torque, rate)
  square = u(3)**2 + u(4)**2
  f(1) = u(2)
  f(2) = (amplitude * u(3) - torque - damping * u(2) - stiffness * u(1) / omega) / (inertia * omega)
  f(3) = u(3) + u(4) - u(3) * square
  f(4) = -u(3) + u(4) - u(4) * square
  if (ijac == 0) return
  dfdu = 0d0
  dfdu(1, 2) = 1d0
  dfdu(2, 1) = -stiffness / (inertia * omega**2)
  dfdu(2, 2) = -(rate + damping) / (inertia * omega)
  dfdu(2, 3) = amplitude / (inertia * omega)
  dfdu(3, 3) = 1d0 - square - 2d0 * u(3)**2
  dfdu(3, 4) = 1d0 - 2d0 * u(3) * u(4)
  dfdu(4, 3) = -1d0 - 2d0 * u(3) * u(4)
  dfdu(4, 4) = 1d0 - square - 2d0 * u(4)**2
  if (ijac == 1) return
  dfdp(:, 1:2) = 0d0
  if (force + slope * abs(u(2)) > 0d0) then
    call brake_torque(u(2), 0d0, torque, rate)
    dfdp(2, 1) = -torque / force * abs(u(2)) * damping / (radius * mu) / (inertia * omega)
  end if
  dfdp(2, 2) = -amplitude / par(2) * u(3) / (inertia * omega)
end subroutine

subroutine stpnt(ndim, u, par, t)
  use brake
  implicit none
  integer, intent(in) :: ndim
  double precision, intent(inout) :: u(ndim), par(*)
  double precision, intent(in) :: t
  call read_numbers
  par(1:2) = start
end subroutine

subroutine bcnd
end subroutine

subroutine icnd
end subroutine

subroutine fopt
end subroutine

subroutine pvls
end subroutine
