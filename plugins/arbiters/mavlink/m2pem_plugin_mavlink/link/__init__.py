"""MAVLink over sockets and serial lines, in asyncio."""
