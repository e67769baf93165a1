"""Coefficients of one-step methods, as data for one kernel per family of methods.

Explicit pairs advance by ``y1 = y + h sum b_i k_i`` with ``k_i = f(t + c_i h, y + h sum a_ij k_j)``. In all of them the
last stage is at the new state (its row of ``a`` is b). It is also the first stage of the next step, and part of the
error estimate ``h sum e_i k_i``.

Rosenbrock methods advance by ``y1 = y + sum m_i u_i`` with one matrix for all stages (Hairer and Wanner, IV.7):

    (1/(h gamma) - J) u_i = f(t + c_i h, y + sum a_ij u_j) + sum (c_ij/h) u_j + h d_i df/dt

In both families a dense output is a polynomial in theta = (t - t_n)/h for each stage's weight.

References
----------
Dormand and Prince, J. Comput. Appl. Math. 6 (1980) 19-26; its interpolant: Shampine, Math. Comp. 46 (1986) 135-150.
Tsitouras, Comput. Math. Appl. 62 (2011) 770-775.
Bogacki and Shampine, Appl. Math. Lett. 2 (1989) 321-325.
Hairer and Wanner, Solving Ordinary Differential Equations II, 2nd ed. (1996), IV.10 (RODAS).
Di Marzo, RODAS5(4), thesis, Geneva (1993), as OrdinaryDiffEq.jl has its coefficients (Rodas5).
Steinebach, in Progress in Differential-Algebraic Equations II (Springer 2020) 165-184 (Rodas4P2).
Rang and Angermann, BIT 45 (2005) 761-787 (ROS34PW2).
"""

from typing import NamedTuple

import numpy as np


class ExplicitTableau(NamedTuple):
    """Coefficients of an explicit embedded pair whose last stage is the first one of the next step."""

    nodes: np.ndarray  # (s,): c
    stages: np.ndarray  # (s, s): a, strictly lower; the last row holds the weights b
    error: np.ndarray  # (s,): b minus the embedded weights
    dense: np.ndarray  # (s, d): weight of stage i at theta is the sum of dense[i, k] theta^(k + 1)
    exponent: float  # order of the error estimate in h


class RosenbrockTableau(NamedTuple):
    """Coefficients of an embedded Rosenbrock method, in the form without products of matrices and vectors."""

    nodes: np.ndarray  # (s,)
    by_time: np.ndarray  # (s,): factors d_i of h df/dt
    stages: np.ndarray  # (s, s): a
    couplings: np.ndarray  # (s, s): c_ij
    weights: np.ndarray  # (s,): m
    error: np.ndarray  # (s,)
    dense: np.ndarray  # (s, d), as for explicit pairs, for weights of u_i
    exponent: float
    gamma: float
    reuse: int  # number of steps with one Jacobian: 1 if the order requires an exact one
    looked_at: float  # theta at which the residual of the dense output is evaluated; 0: never
    residual: float  # factor on the error of this residual
    speeds: np.ndarray  # (s + 1, s): D of `implied_speeds`
    begun: np.ndarray  # (s + 1,): f of `implied_speeds`


def _lower(*rows):
    """Return a square matrix from its entries below the diagonal, row by row from the second row on."""
    matrix = np.zeros((len(rows) + 1, len(rows) + 1))
    for i, row in enumerate(rows, 1):
        matrix[i, : len(row)] = row
    return matrix


def implied_speeds(stages, couplings, gamma, error):
    """Return the coefficients D (s + 1, s) and f (s + 1,) of speeds v that the stage increments u of q' = v imply.

    If v is a state, too, with increments w, initial value v0 and drift d, the stages of q are
    1/(h gamma) u_i - w_i = v0 + a_ij w_j - d + c_ij u_j/h. So w = (1 + a)^-1 ((1/gamma - c) u/h - (v0 - d)), and v of
    stage i is v0 + D_ij u_j/h + f_i (v0 - d). The last rows of D and f are those of the error of v in the step.
    """
    inverse, mixed = np.linalg.inv(np.eye(len(stages)) + stages), np.vstack([stages, error])
    return mixed @ inverse @ (np.eye(len(stages)) / gamma - couplings), -(mixed @ inverse).sum(axis=1)


def _hermite(weights):
    """Return the cubic dense output (s, 3) through the states and their derivatives at both ends of a step."""
    dense = np.outer(weights, [0.0, 3.0, -2.0])
    dense[0] += [1.0, -2.0, 1.0]
    dense[-1] += [0.0, -1.0, 1.0]
    return dense


def _dormand_prince():
    stages = _lower(
        [1 / 5],
        [3 / 40, 9 / 40],
        [44 / 45, -56 / 15, 32 / 9],
        [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729],
        [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656],
        [35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
    )
    error = np.array([71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40])
    bend = np.array([
        -12715105075 / 11282082432, 0.0, 87487479700 / 32700410799, -10690763975 / 1880347072,
        701980252875 / 199316789632, -1453857185 / 822651844, 69997945 / 29380423,
    ])  # fmt: skip
    dense = np.pad(_hermite(stages[-1]), ((0, 0), (0, 1))) + np.outer(bend, [0.0, 1.0, -2.0, 1.0])
    return ExplicitTableau(np.array([0.0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0, 1.0]), stages, error, dense, 5.0)


def _tsitouras():
    stages = _lower(
        [0.161],
        [-0.008480655492356989, 0.335480655492357],
        [2.8971530571054935, -6.359448489975075, 4.3622954328695815],
        [5.325864828439257, -11.748883564062828, 7.4955393428898365, -0.09249506636175525],
        [5.86145544294642, -12.92096931784711, 8.159367898576159, -0.071584973281401, -0.028269050394068383],
        [0.09646076681806523, 0.01, 0.4798896504144996, 1.379008574103742, -3.290069515436081, 2.324710524099774],
    )
    error = np.array([
        -0.00178001105222577714, -0.0008164344596567469, 0.007880878010261995, -0.1447110071732629,
        0.5823571654525552, -0.45808210592918697, 1 / 66,
    ])  # fmt: skip
    dense = np.array([
        [1.0, -2.763706197274826, 2.9132554618219126, -1.0530884977290216],
        [0.0, 0.1317, -0.2234, 0.1017],
        [0.0, 3.9302962368947516, -5.941033872131505, 2.490627285651253],
        [0.0, -12.411077166933676, 30.33818863028232, -16.548102889244902],
        [0.0, 37.50931341651104, -88.1789048947664, 47.37952196281928],
        [0.0, -27.896526289197286, 65.09189467479366, -34.87065786149661],
        [0.0, 1.5, -4.0, 2.5],
    ])  # fmt: skip
    nodes = np.array([0.0, 0.161, 0.327, 0.9, 0.9800255409045097, 1.0, 1.0])
    return ExplicitTableau(nodes, stages, error, dense, 5.0)


def _bogacki_shampine():
    stages = _lower([1 / 2], [0.0, 3 / 4], [2 / 9, 1 / 3, 4 / 9])
    error = np.array([-5 / 72, 1 / 12, 1 / 9, -1 / 8])
    return ExplicitTableau(np.array([0.0, 1 / 2, 3 / 4, 1.0]), stages, error, _hermite(stages[-1]), 3.0)


def _classical():
    """Return the tableau of Kutta's fourth-order method.

    The embedded method of third order uses the slope at the new state instead of k_4."""
    stages = _lower([1 / 2], [0.0, 1 / 2], [0.0, 0.0, 1.0], [1 / 6, 1 / 3, 1 / 3, 1 / 6])
    error = np.array([0.0, 0.0, 0.0, 1 / 6, -1 / 6])
    return ExplicitTableau(np.array([0.0, 1 / 2, 1 / 2, 1.0, 1.0]), stages, error, _hermite(stages[-1]), 4.0)


def _rodas(nodes, by_time, stages, couplings, *bends, exponent=4.0, gamma=0.25, looked_at=0.0, residual=0.0):
    """Return the tableau of a method of the RODAS type.

    The last two stages are at the end of the step; the last one is the error estimate. ``stages`` are the rows up to
    the last but one. The weights of the dense output are theta times those of the step, plus (1 - theta) theta^k times
    the k-th of ``bends``, which are given for some or all stages."""
    weights, size = np.array([*stages[-1], 1.0, 1.0]), len(nodes) + 2
    bent = [np.zeros(size), *(np.append(bend, np.zeros(size - len(bend))) for bend in bends), np.zeros(size)]
    dense = np.diff(bent, axis=0).T + np.outer(weights, np.arange(len(bends) + 1) == 0)
    stages, couplings, error = _lower(*stages, [*stages[-1], 1.0]), _lower(*couplings), np.eye(size)[-1]
    return RosenbrockTableau(
        np.array([*nodes, 1.0, 1.0]), np.array([*by_time, 0.0, 0.0]), stages, couplings, weights, error, dense,
        exponent, gamma, 1, looked_at, residual, *implied_speeds(stages, couplings, gamma, error),
    )  # fmt: skip


def _rodas4():
    return _rodas(
        [0.0, 0.386, 0.21, 0.63],
        [0.25, -0.1043, 0.1035, -0.0362],
        [
            [1.544],
            [0.9466785280815826, 0.2557011698983284],
            [3.314825187068521, 2.896124015972201, 0.9986419139977817],
            [1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950],
        ],
        [
            [-5.6688],
            [-2.430093356833875, -0.2063599157091915],
            [-0.1073529058151375, -9.594562251023355, -20.47028614809616],
            [7.496443313967647, -10.24680431464352, -33.99990352819905, 11.70890893206160],
            [8.083246795921522, -7.981132988064893, -31.52159432874371, 16.31930543123136, -6.058818238834054],
        ],
        [10.12623508344586, -7.487995877610167, -34.80091861555747, -7.992771707568823, 1.025137723295662],
        [-0.6762803392801253, 6.087714651680015, 16.43084320892478, 24.76722511418386, -6.594389125716872],
    )


def _rodas4p2():
    return _rodas(
        [0.0, 0.75, 0.321448134013046, 0.519745732277726],
        [0.25, -0.5, -0.189532918363016, 0.085612108792769],
        [
            [3.0],
            [0.906377755268814, -0.189707390391685],
            [3.758617027739064, 1.161741776019525, -0.849258085312803],
            [7.089566927282776, 4.573591406461604, -8.423496976860259, -0.959280113459775],
        ],
        [
            [-12.0],
            [-6.354581592719008, 0.338972550544623],
            [-8.575016317114033, -7.606483992117508, 12.224997650124820],
            [-5.888975457523102, -8.157396617841821, 24.805546872612922, 12.790401512796979],
            [-4.408651676063871, -6.692003137674639, 24.625568527593117, 16.627521966636085, -5.714285714285718],
        ],
        [-5.323528268423303, -10.042123754867493, 17.175254928256965, -5.079931171878093, -0.016185991706112],
        [6.984505741529879, 6.914061169603662, -0.849178943070653, 18.104410789349338, -3.516963011559032],
    )


def _rodas5():
    """Return the tableau of Rodas5, which has no node between 0.49 and 1.

    Its stages and error estimate do not detect short events between these nodes, e.g. a switched torque or a locking
    wheel. Evaluating the residual at theta = 0.74 reduces errors to a hundredth."""
    return _rodas(
        [0.0, 0.38, 0.3878509998321533, 0.483971893787384, 0.457047700881958, 1],
        [0.19, -0.1823079225333714636, -0.319231832186874912, 0.3449828624725343, -0.377417564392089818, 0],
        [
            [2.0],
            [3.040894194418781, 1.041747909077569],
            [2.576417536461461, 1.62208306077664, -0.9089668560264532],
            [2.760842080225597, 1.446624659844071, -0.3036980084553738, 0.2877498600325443],
            [-14.09640773051259, 6.925207756232704, -41.47510893210728, 2.343771018586405, 24.13215229196062],
            [-14.09640773051259, 6.925207756232704, -41.47510893210728, 2.343771018586405, 24.13215229196062, 1],
        ],
        [
            [-10.31323885133993],
            [-21.04823117650003, -7.234992135176716],
            [32.22751541853323, -4.943732386540191, 19.44922031041879],
            [-20.69865579590063, -8.816374604402768, 1.260436877740897, -0.7495647613787146],
            [-46.22004352711257, -17.49534862857472, -289.6389582892057, 93.60855400400906, 318.3822534212147],
            [34.20013733472935, -14.1553540271769, 57.823356409884, 25.83362985412365, 1.408950972071624,
             -6.551835421242162],
            [42.57076742291101, -13.80770672017997, 93.98938432427124, 18.77919633714503, -31.5835918722337,
             -6.685968952921985, -5.810979938412932],
        ],
        [27.354592673333357, -6.925207756232857, 26.40037733258859, 0.5635230501052979, -4.699151156849391,
         -1.6008677469422725, -1.5306074446748028, -1.3929872940716344],
        [44.19024239501722, 1.3677947663381929e-13, 202.93261852171622, -35.5669339789154, -181.91095152160645,
         3.4116351403665033, 2.5793540257308067, 2.2435122582734066],
        [-44.0988150021747, -5.755396159656812e-13, -181.26175034586677, 56.99302194811676, 183.21182741427398,
         -7.480257918273637, -5.792426076169686, -5.32503859794143],
        exponent=5.0, gamma=0.19, looked_at=0.74, residual=10.0,
    )  # fmt: skip


def _ros34pw2():
    gamma = 0.43586652150845900
    alpha = _lower([0.87173304301691801], [0.84457060015369423, -0.11299064236484185], [0.0, 0.0, 1.0])
    coupling = gamma * np.eye(4) + _lower(
        [-0.87173304301691801],
        [-0.90338057013044082, 0.054180672388095326],
        [0.24212380706095346, -1.2232505839045147, 0.54526025533510214],
    )
    b = np.array([0.24212380706095346, -1.2232505839045147, 1.5452602553351020, 0.43586652150845900])
    embedded = np.array([0.37810903145819369, -0.096042292212423178, 0.5, 0.21793326075422950])
    dense = np.array([
        [1.0564298455794094, -1.3864882699759573, 0.5721822314575016],
        [2.296429974281067, -8.262611700275677, 4.742931142090097],
        [-1.307599564525376, 7.250979895056055, -4.398120075195578],
        [-1.045260255335102, 2.398120075195581, -0.9169932983520199],
    ])  # fmt: skip
    inverse = np.linalg.inv(coupling)
    stages, couplings, error = alpha @ inverse, np.eye(4) / gamma - inverse, (b - embedded) @ inverse
    return RosenbrockTableau(
        alpha.sum(axis=1), coupling.sum(axis=1), stages, couplings, b @ inverse, error, inverse.T @ dense, 3.0, gamma,
        20, 0.0, 0.0, *implied_speeds(stages, couplings, gamma, error),
    )  # fmt: skip


EXPLICIT = {
    "rk45": _dormand_prince(),
    "tsit5": _tsitouras(),
    "rk23": _bogacki_shampine(),
    "rk4": _classical(),
}
"""Explicit pairs by name: orders 5(4), 5(4), 3(2) and 4(3)."""

ROSENBROCK = {"rodas5": _rodas5(), "rodas4": _rodas4(), "rodas4p2": _rodas4p2(), "ros34pw2": _ros34pw2()}
"""Rosenbrock methods by name: orders 5(4), 4(3), 4(3) and 3(2)."""
