"""Taylor series of the torques of elements with a scale that varies in time.

Such a torque is T = s(t) L, with the scale s and the line L of the present piece, which is linear
in the state. T is an input of the machine, which is otherwise linear. The coefficient of order k of
T follows from those of s and L up to this order. The series of the states and of T are therefore
computed order by order, as those of ``curves``.
"""

from wedgebrake.dynamics.jit import borrowing, embedded
from wedgebrake.solvers.machine.events.cells import value


@borrowing
def multiply(problem, run):
    """Set the torques of elements with a scale at the beginning of a cell."""
    z, states = run.z, problem.states
    for product in run.products:
        line = value(problem.elements.lines[run.places[product.element].piece], z)
        z[states + product.input, 0] = line * z[states + product.scale, 0]


@embedded
def begin_products(problem, run):
    """Remove the torques of elements with a scale from the inputs."""
    for product in run.products:
        run.z[problem.states + product.input] = 0.0


@borrowing
def extend_product(problem, run, product, series, line, k):
    """Store the coefficient of order k of the torque of an element, or of its derivative.

    series : of the states, known up to order k, and of the torque: those of the machine, or those
             of a column of the derivative
    line   : series of the line of the present piece
    """
    row = problem.elements.lines[run.places[product.element].piece]
    total, scale = 0.0, run.z[problem.states + product.scale]
    for j in range(row.size):
        total += row[j] * series[j, k]
    line[k] = total
    total = 0.0
    for i in range(k + 1):
        total += line[i] * scale[k - i]
    series[problem.states + product.input, k] = total


@borrowing
def add_product(problem, run, slot, product, z, k):
    """Add the torque of an element to the rates of the states, for ``next_coefficient``."""
    column = problem.states + product.input
    for i in range(problem.inverse.size, problem.states):
        z[i, k + 1] += run.systems.rates[slot, i, column] * z[column, k]


@borrowing
def expand_direct(problem, run, number, terms):
    """Store the series of the direct effect of a parameter on the torques of the elements."""
    z, tangents = run.z, run.tangents
    for place in range(run.products.size):
        product, direct = run.products[place], tangents.direct[number, place]
        by_line = tangents.factors[number, run.places[product.element].piece]
        by_scale, scale = tangents.scales[number, product.element], problem.states + product.scale
        direct[:terms] = 0.0
        for j in range(by_line.size):
            if by_line[j] != 0.0:
                for k in range(terms):
                    for i in range(k + 1):
                        direct[k] += by_line[j] * z[j, i] * z[scale, k - i]
            if by_scale[j] != 0.0:
                for k in range(terms):
                    for i in range(k + 1):
                        direct[k] += by_scale[j] * z[j, i] * product.line[k - i]
