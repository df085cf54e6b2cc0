"""The flight itself, in Basilisk: a rigid body on four reaction wheels that follows the reference.

Perfect sensors, no flexible modes. The wheels have 1.25 times the torque that the plan's
acceleration needs about the most demanding axis. Eclipses are Basilisk's, with penumbra.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from Basilisk.architecture import messaging, sysModel
from Basilisk.fswAlgorithms import attTrackingError, mrpFeedback, rwMotorTorque
from Basilisk.simulation import (
    eclipse,
    reactionWheelStateEffector,
    simpleNav,
    spacecraft,
)
from Basilisk.utilities import SimulationBaseClass, simIncludeRW

from benchmarks.flight.mission import Floats, Mission
from benchmarks.flight.reference import STEP_S, Flight, Limits, Reference
from benchmarks.flight.rodrigues import boresights, parameters
from benchmarks.flight.world import orbit, satellite_km, sun_km

_INERTIA_KG_M2: Final = (20.0, 18.0, 15.0)
_TORQUE_RESERVE: Final = 1.25
_WHEEL_INERTIA_KG_M2: Final = 0.2
_STIFFNESS_N_M: Final = 30.0  # of the control, per unit of the modified Rodrigues parameters
_DAMPING_N_M_S: Final = 25.0
_STEP_NS: Final = round(STEP_S * 1e9)
_SUN_STEP_S: Final = 60.0


def fly(mission: Mission, reference: Reference, limits: Limits) -> Flight:
    """Fly a reference."""
    simulation = SimulationBaseClass.SimBaseClass()
    simulation.CreateNewProcess("flight").addTask(simulation.CreateNewTask("step", _STEP_NS))
    told = parameters(reference.attitude)
    body = _body(reference, told)
    effector, wheels, most_torque_n_m = _wheels(body, limits)
    play = _Playback(mission, reference, told)
    sensor = simpleNav.SimpleNav()
    sensor.scStateInMsg.subscribeTo(body.scStateOutMsg)
    error, feedback, motors = _control(sensor, wheels, effector, play)
    effector.rwMotorCmdInMsg.subscribeTo(motors.rwMotorTorqueOutMsg)
    shadow = eclipse.Eclipse()
    shadow.sunInMsg.subscribeTo(play.sun)
    shadow.addPlanetToModel(play.earth)
    shadow.addSpacecraftToModel(play.site)
    recorder = _Recorder(body, shadow, motors, len(told))
    # In this order in each step: first the motion, then the control's reaction to it.
    for rank, model in enumerate(
        (play, effector, body, sensor, error, feedback, motors, shadow, recorder)
    ):
        simulation.AddModelToTask("step", model, 100 - rank)
    simulation.InitializeSimulation()
    simulation.ConfigureStopTime((len(told) - 1) * _STEP_NS)
    simulation.ExecuteSimulation()
    return Flight(
        boresights(recorder.attitude),
        np.degrees(np.linalg.norm(recorder.rate, axis=1)),
        recorder.lit,
        recorder.most_torque_n_m / most_torque_n_m,
    )


def _body(reference: Reference, told: Floats) -> Any:
    body = spacecraft.Spacecraft()
    body.ModelTag = "body"
    body.hub.mHub = 200.0
    body.hub.IHubPntBc_B = np.diag(_INERTIA_KG_M2).tolist()
    body.hub.sigma_BNInit = told[0].reshape(3, 1).tolist()
    rate = reference.attitude[0].T @ reference.rate[0]
    body.hub.omega_BN_BInit = rate.reshape(3, 1).tolist()
    return body


def _wheels(body: Any, limits: Limits) -> tuple[Any, Any, float]:
    """Mount four wheels on the edges of a pyramid; return them, and the torque of one."""
    along = 1.0 / np.sqrt(3.0)
    axes = [[x, y, along] for x, y in ((along, along), (-along, along), (-along, -along),
                                       (along, -along))]  # fmt: skip
    # Each wheel contributes to the torque about each of the body's axes at the same time.
    most = float(np.linalg.norm(_INERTIA_KG_M2)) * limits.acceleration
    torque_n_m = _TORQUE_RESERVE * most / (4.0 * along)
    factory = simIncludeRW.rwFactory()
    for axis in axes:
        factory.create("custom", axis, Js=_WHEEL_INERTIA_KG_M2, u_max=float(torque_n_m))
    effector = reactionWheelStateEffector.ReactionWheelStateEffector()
    factory.addToSpacecraft("wheels", effector, body)
    return effector, factory.getConfigMessage(), float(torque_n_m)


def _control(sensor: Any, wheels: Any, effector: Any, play: _Playback) -> tuple[Any, Any, Any]:
    """Return the modules that measure the error, command a torque and allot it to the wheels."""
    error = attTrackingError.attTrackingError()
    error.attNavInMsg.subscribeTo(sensor.attOutMsg)
    error.attRefInMsg.subscribeTo(play.reference)
    feedback = mrpFeedback.mrpFeedback()
    feedback.K, feedback.P, feedback.Ki = _STIFFNESS_N_M, _DAMPING_N_M_S, -1.0
    feedback.guidInMsg.subscribeTo(error.attGuidOutMsg)
    vehicle = messaging.VehicleConfigMsgPayload()
    vehicle.ISCPntB_B = np.diag(_INERTIA_KG_M2).ravel().tolist()
    play.vehicle = messaging.VehicleConfigMsg().write(vehicle)
    feedback.vehConfigInMsg.subscribeTo(play.vehicle)
    feedback.rwParamsInMsg.subscribeTo(wheels)
    feedback.rwSpeedsInMsg.subscribeTo(effector.rwSpeedOutMsg)
    motors = rwMotorTorque.rwMotorTorque()
    motors.controlAxes_B = np.eye(3).ravel().tolist()
    motors.rwParamsInMsg.subscribeTo(wheels)
    motors.vehControlInMsg.subscribeTo(feedback.cmdTorqueOutMsg)
    play.wheels = wheels  # a message lives only while something references it
    return error, feedback, motors


class _Playback(sysModel.SysModel):  # type: ignore[misc]  # Basilisk has no types
    """Publishes the wanted attitude and the positions of satellite and sun, step by step."""

    def __init__(self, mission: Mission, reference: Reference, told: Floats) -> None:
        super().__init__()
        self.ModelTag = "playback"
        self._mission, self._orbit = mission, orbit(mission)
        self._told, self._turns = told, reference
        self.reference = messaging.AttRefMsg()
        self.site, self.sun = messaging.SCStatesMsg(), messaging.SpicePlanetStateMsg()
        at_rest = messaging.SpicePlanetStateMsgPayload()
        at_rest.PlanetName = "earth"
        self.earth = messaging.SpicePlanetStateMsg().write(at_rest)
        self.vehicle: Any = None
        self.wheels: Any = None

    def Reset(self, now_ns: int) -> None:  # noqa: N802  # Basilisk calls it so
        """Publish the initial state."""
        self.UpdateState(now_ns)

    def UpdateState(self, now_ns: int) -> None:  # noqa: N802  # likewise
        """Publish the state at an instant."""
        row = min(now_ns // _STEP_NS, len(self._told) - 1)
        wanted = messaging.AttRefMsgPayload()
        wanted.sigma_RN = self._told[row].tolist()
        wanted.omega_RN_N = self._turns.rate[row].tolist()
        wanted.domega_RN_N = self._turns.acceleration[row].tolist()
        self.reference.write(wanted, now_ns, self.moduleID)
        where = messaging.SCStatesMsgPayload()
        where.r_BN_N = (1000.0 * satellite_km(self._orbit, now_ns * 1e-9)[0]).tolist()
        self.site.write(where, now_ns, self.moduleID)
        if now_ns % round(_SUN_STEP_S * 1e9) == 0:
            sun = messaging.SpicePlanetStateMsgPayload()
            sun.PlanetName = "sun"
            sun.PositionVector = (1000.0 * sun_km(self._mission, now_ns * 1e-9)).tolist()
            self.sun.write(sun, now_ns, self.moduleID)


class _Recorder(sysModel.SysModel):  # type: ignore[misc]  # Basilisk has no types
    """Keeps only what is judged: a day has 864,001 steps."""

    def __init__(self, body: Any, shadow: Any, motors: Any, num_steps: int) -> None:
        super().__init__()
        self.ModelTag = "recorder"
        self._body, self._shadow, self._motors = body, shadow, motors
        self.attitude, self.rate = np.zeros((num_steps, 3)), np.zeros((num_steps, 3))
        self.lit = np.zeros(num_steps)
        self.most_torque_n_m = 0.0

    def Reset(self, now_ns: int) -> None:  # noqa: N802  # Basilisk calls it so
        """Start with empty records."""

    def UpdateState(self, now_ns: int) -> None:  # noqa: N802  # likewise
        """Record the state at an instant."""
        row = min(now_ns // _STEP_NS, len(self.lit) - 1)
        state = self._body.scStateOutMsg.read()
        self.attitude[row], self.rate[row] = state.sigma_BN, state.omega_BN_B
        self.lit[row] = self._shadow.eclipseOutMsgs[0].read().shadowFactor
        torques_n_m = self._motors.rwMotorTorqueOutMsg.read().motorTorque[:4]
        self.most_torque_n_m = max(self.most_torque_n_m, *map(abs, torques_n_m))
