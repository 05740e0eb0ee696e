"""The simulated vehicles of a fleet file: `m2pem sim ros`, on 127.0.0.1 alone."""

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

ARGUMENTS = [
    DeclareLaunchArgument("fleet", description="The fleet file."),
    DeclareLaunchArgument(
        "speed", default_value="1", description="Simulated seconds in a real second."
    ),
    DeclareLaunchArgument("fault", default_value="", description="What goes wrong; empty: none."),
    DeclareLaunchArgument(
        "use_sim_time", default_value="false", description="Follow /clock, in place of speed."
    ),
    DeclareLaunchArgument("log_level", default_value="info", description="Of what ROS logs."),
]


def simulators(context: LaunchContext) -> list[Node]:
    """Return the process. It has many nodes: it gets no name and no namespace."""
    given = {
        each.name: LaunchConfiguration(each.name).perform(context).strip() for each in ARGUMENTS
    }
    follows = given["use_sim_time"].lower() == "true"
    words = ["sim", "ros", "--fleet", given["fleet"]]
    if not follows:
        words += ["--speed", given["speed"]]
    if given["fault"]:
        words += ["--fault", given["fault"]]
    return [
        Node(
            package="m2pem",
            executable="m2pem",
            arguments=words,
            parameters=[{"use_sim_time": follows}],
            ros_arguments=["--log-level", given["log_level"]],
            output="screen",
        )
    ]


def generate_launch_description() -> LaunchDescription:
    """Return what `ros2 launch m2pem simulators.launch.py fleet:=FILE` starts."""
    return LaunchDescription([*ARGUMENTS, OpaqueFunction(function=simulators)])
