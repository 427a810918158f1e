! Two inertias, one with a smoothed brake, for AUTO-07p (docs/equations.md, "Machines"):
!
!   J1 q1'' + c q1' + k q1 + c2 (q1' - q2') + k2 (q1 - q2) + R F_a(q1') g(m(R q1')) = T sin(omega t)
!   J2 q2'' + c2 (q2' - q1') + k2 (q2 - q1) = 0
!
! with F_a = max(0, force + slope |q1'|), m = mu tanh(steepness v), g(m) = m/(tangent - m). Time in
! units of 1/omega; u(1:2) = omega q, u(3:4) = q', u(5:6) = sin, cos of the torque's phase, from an
! oscillator whose limit cycle is the unit circle. Parameters: par(1) = slope, par(2) = T. The file
! pair.txt holds the numbers in SI units, slope and T of the first orbit last.

module pair
  implicit none
  double precision :: inertia(2), damping(2), stiffness(2), radius, force, mu, steepness
  double precision :: omega, tangent, start(2)
  logical :: known = .false.
contains

  subroutine read_numbers
    integer :: unit
    if (known) return
    open (newunit=unit, file='pair.txt', status='old', action='read')
    read (unit, *) inertia, damping, stiffness, radius, force, mu, steepness, omega, tangent, start
    close (unit)
    known = .true.
  end subroutine

  ! R F_a g(m), and its derivatives by the speed and by the slope of F_a.
  subroutine brake_torque(velocity, slope, torque, rate, by_slope)
    double precision, intent(in) :: velocity, slope
    double precision, intent(out) :: torque, rate, by_slope
    double precision :: layer, m, dm, g, dg, press, dpress
    layer = tanh(steepness * radius * velocity)
    m = mu * layer
    dm = mu * steepness * (1d0 - layer**2)
    g = m / (tangent - m)
    dg = tangent / (tangent - m)**2
    press = force + slope * abs(velocity)
    dpress = slope * sign(1d0, velocity)
    by_slope = radius * abs(velocity) * g
    if (press < 0d0) then
      press = 0d0
      dpress = 0d0
      by_slope = 0d0
    end if
    torque = radius * press * g
    rate = radius * (dpress * g + press * dg * dm * radius)
  end subroutine

end module

subroutine func(ndim, u, icp, par, ijac, f, dfdu, dfdp)
  use pair
  implicit none
  integer, intent(in) :: ndim, icp(*), ijac
  double precision, intent(in) :: u(ndim), par(*)
  double precision, intent(out) :: f(ndim)
  double precision, intent(inout) :: dfdu(ndim, ndim), dfdp(ndim, *)
  double precision :: torque, rate, by_slope, square, link, one, other
  call read_numbers
  call brake_torque(u(3), par(1), torque, rate, by_slope)
  square = u(5)**2 + u(6)**2
  link = damping(2) * (u(3) - u(4)) + stiffness(2) * (u(1) - u(2)) / omega
  one = inertia(1) * omega
  other = inertia(2) * omega
  f(1) = u(3)
  f(2) = u(4)
  f(3) = (par(2) * u(5) - torque - damping(1) * u(3) - stiffness(1) * u(1) / omega - link) / one
  f(4) = link / other
  f(5) = u(5) + u(6) - u(5) * square
  f(6) = -u(5) + u(6) - u(6) * square
  if (ijac == 0) return
  dfdu = 0d0
  dfdu(1, 3) = 1d0
  dfdu(2, 4) = 1d0
  dfdu(3, 1) = -(stiffness(1) + stiffness(2)) / omega / one
  dfdu(3, 2) = stiffness(2) / omega / one
  dfdu(3, 3) = -(rate + damping(1) + damping(2)) / one
  dfdu(3, 4) = damping(2) / one
  dfdu(3, 5) = par(2) / one
  dfdu(4, 1) = stiffness(2) / omega / other
  dfdu(4, 2) = -stiffness(2) / omega / other
  dfdu(4, 3) = damping(2) / other
  dfdu(4, 4) = -damping(2) / other
  dfdu(5, 5) = 1d0 - square - 2d0 * u(5)**2
  dfdu(5, 6) = 1d0 - 2d0 * u(5) * u(6)
  dfdu(6, 5) = -1d0 - 2d0 * u(5) * u(6)
  dfdu(6, 6) = 1d0 - square - 2d0 * u(6)**2
  if (ijac == 1) return
  dfdp(:, 1:2) = 0d0
  dfdp(3, 1) = -by_slope / one
  dfdp(3, 2) = u(5) / one
end subroutine

subroutine stpnt(ndim, u, par, t)
  use pair
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
