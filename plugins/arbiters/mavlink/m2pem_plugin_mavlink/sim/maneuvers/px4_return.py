"""AUTO.RTL of PX4: like ArduPilot's, but near home it does not climb as high."""

from m2pem_plugin_mavlink.sim.maneuvers.returning import ReturnToLaunch


class Px4Return(ReturnToLaunch):
    """Climbs to RTL_RETURN_ALT, but within a cone of 45 degrees (RTL_CONE_ANG) above home no higher
    than the cone is."""

    def least_up_m(self) -> float:
        """On the cone, or at the height that is set."""
        pilot = self.autopilot
        home = pilot.home.point
        cone_m = max(pilot.position.distance_m(home), pilot.parameters["RTL_DESCEND_ALT"])
        return home.up_m + min(pilot.tuning.return_up_m, cone_m)
