"""`m2pem ros onboard` alone, whatever else is installed."""

from m2pem_plugin_ros.onboard.command_line import onboard

if __name__ == "__main__":
    onboard()
