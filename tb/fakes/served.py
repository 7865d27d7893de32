# SPDX-License-Identifier: Apache-2.0
"""A served bus for tests: nodes with the compiled firmware behind a gateway with all its doors."""

import contextlib
import http.client
import json
import socket
import threading

from moire.bus.gateway import Gateway
from moire.web.client import StreamClient
from moire.web.door import Settings, WebDoor
from tb.fakes.bus_node import BusNode
from tb.fakes.rs485_bus import Rs485Bus

HANG_S = 60  # of the clock: what has not come by then never will


class ServedTransport:
    """A gateway in a thread, which begins with `begin`, when its doors are open."""

    def __init__(self, far):
        self.far, self.gateway = far, Gateway(far)
        self.ending, self.looked = False, threading.Condition()
        self.thread = threading.Thread(target=self.run)

    def begin(self):
        self.thread.start()

    def run(self):
        while not self.ending:
            self.gateway.poll(self.gateway.follow_clock())
            with self.looked:
                self.looked.notify_all()
        self.gateway.close()

    def wait_until(self, true):
        with self.looked:
            assert self.looked.wait_for(true, HANG_S), "waited in vain"

    def end(self):
        self.ending = True
        self.thread.join()


class ServedBus(ServedTransport):
    """The same with nodes of compiled firmware."""

    def __init__(self, *nodes):
        super().__init__(Rs485Bus(*nodes))


class Served(ServedBus):
    """A gateway in a thread, with the doors of HTTP, WebSocket and TCP."""

    def __init__(self, *nodes, **settings):
        super().__init__(*nodes)
        self.tcp = f"socket://127.0.0.1:{self.gateway.open_tcp('127.0.0.1', 0)}"
        self.door = WebDoor(self.gateway, Settings(**settings))
        self.door.open()
        self.begin()

    def end(self):
        super().end()
        self.door.close()

    @property
    def node(self):
        return self.far.nodes[0]

    @property
    def place(self):
        return self.door.listener.getsockname()[:2]

    def http(self):
        return Http(*self.place)

    def stream(self, **fields):
        return StreamClient(self.door.url, HANG_S, **fields)

    def raw(self, data=b""):
        """A connection that has sent these bytes."""
        made = socket.create_connection(self.place, HANG_S)
        with contextlib.suppress(ConnectionError):  # closed before all of it was taken
            made.sendall(data)
        return made


class Http(http.client.HTTPConnection):
    """A connection, and a client; `headers` go with every request."""

    def __init__(self, host, port, **headers):
        super().__init__(host, port, HANG_S)
        self.headers = headers

    def begin(self, method, path, body=None, **headers):
        text = body if body is None or isinstance(body, bytes) else json.dumps(body)
        given = {name.replace("_", "-"): value for name, value in (self.headers | headers).items()}
        self.request(method, path, text, given)

    def end(self):
        found = self.getresponse()
        return found.status, json.loads(found.read())

    def ask(self, method, path, body=None, **headers):
        """(status, JSON)"""
        self.begin(method, path, body, **headers)
        return self.end()

    def done(self, *arguments):
        """The JSON of a request that must be done."""
        status, values = self.ask(*arguments)
        assert status == 200, values
        return values

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()


def homed(address=1, **options):
    node = BusNode(address, **options)
    node.home()
    return node
