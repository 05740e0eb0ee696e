"""The executive as a service, with operators over ROS: `m2pem serve`."""

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

ARGUMENTS = [
    DeclareLaunchArgument("fleet", description="The fleet file."),
    DeclareLaunchArgument("ocu", default_value="mocu", description="Operator control units."),
    DeclareLaunchArgument("journal", default_value="", description="Empty: that of m2pem."),
    DeclareLaunchArgument(
        "speed", default_value="1", description="Seconds of mission time in a real second."
    ),
    DeclareLaunchArgument(
        "use_sim_time",
        default_value="false",
        description="Stamps of messages are those of /clock; mission time never is.",
    ),
    DeclareLaunchArgument("log_level", default_value="info", description="Of what ROS logs."),
]


def executive(context: LaunchContext) -> list[Node]:
    """Return the process. It has several nodes: it gets no name and no namespace."""
    given = {
        each.name: LaunchConfiguration(each.name).perform(context).strip() for each in ARGUMENTS
    }
    words = ["serve", "--fleet", given["fleet"], "--ocu", given["ocu"], "--speed", given["speed"]]
    if given["journal"]:
        words += ["--journal", given["journal"]]
    return [
        Node(
            package="m2pem",
            executable="m2pem",
            arguments=words,
            parameters=[{"use_sim_time": given["use_sim_time"].lower() == "true"}],
            ros_arguments=["--log-level", given["log_level"]],
            output="screen",
        )
    ]


def generate_launch_description() -> LaunchDescription:
    """Return what `ros2 launch m2pem executive.launch.py fleet:=FILE` starts."""
    return LaunchDescription([*ARGUMENTS, OpaqueFunction(function=executive)])
