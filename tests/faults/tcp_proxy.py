"""A proxy in front of a server: the network between an executive and its database, or a host.

While it is `partitioned`, it carries nothing and ends no connection, as a network that loses all
packets does; what was sent meanwhile arrives when that is over.
"""

import select
import socket
import threading
from pathlib import Path


class TcpProxy:
    """It listens at `port` of 127.0.0.1, and connects to the socket, or the port, of a server of
    this host."""

    def __init__(self, server: Path | int) -> None:
        self.partitioned = False
        self._server = server
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._listener.getsockname()[1]
        self._other: dict[socket.socket, socket.socket] = {}
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def close(self) -> None:
        """End all connections."""
        self._ended.set()
        self._thread.join()
        for each in (self._listener, *self._other):
            each.close()

    def _run(self) -> None:
        while not self._ended.is_set():
            if self.partitioned:
                self._ended.wait(0.01)
                continue
            ready, _, _ = select.select([self._listener, *self._other], [], [], 0.02)
            for each in ready:
                if self.partitioned:
                    break
                if each is self._listener:
                    self._accept()
                elif each in self._other:
                    self._carry(each)

    def _accept(self) -> None:
        client, _ = self._listener.accept()
        try:
            server = self._connected()
        except OSError:  # it is killed
            client.close()
            return
        self._other[client], self._other[server] = server, client

    def _connected(self) -> socket.socket:
        if isinstance(self._server, int):
            return socket.create_connection(("127.0.0.1", self._server))
        server = socket.socket(socket.AF_UNIX)
        server.connect(str(self._server))
        return server

    def _carry(self, sender: socket.socket) -> None:
        receiver = self._other[sender]
        try:
            data = sender.recv(65536)
            receiver.sendall(data)
        except OSError:
            data = b""
        if not data:
            for each in (sender, receiver):
                del self._other[each]
                each.close()
