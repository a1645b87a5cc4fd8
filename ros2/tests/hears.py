"""In: addresses. Out: sessions of Zenoh that find nobody by themselves, and what their subscribers have heard.
Frame and unit: s."""

import atexit
import os
import socket
import struct
import sys
import time
import traceback

import zenoh


def until(what, limit=20.0):
    """Waits until it is true, and returns it."""
    end = time.monotonic() + limit
    while not (got := what()):
        assert time.monotonic() < end, f"not within {limit} s"
        time.sleep(0.01)
    return got


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as s:
        return s.getsockname()[1]


def session(mode, **endpoints):
    """A session that finds nobody by itself."""
    config = zenoh.Config()
    config.insert_json5("mode", f'"{mode}"')
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("scouting/gossip/enabled", "false")
    # By default a router drops what a busy machine does not take within a millisecond.
    config.insert_json5("transport/link/tx/queue/size/data", "16")
    config.insert_json5("transport/link/tx/queue/congestion_control/drop/wait_before_drop", "2000000")
    for key in ["listen", "connect"]:
        address = endpoints.get(key)
        config.insert_json5(f"{key}/endpoints", f'["{address}"]' if address else "[]")
    return zenoh.open(config)


class Heard:
    """A subscriber of all topics of a domain."""

    def __init__(self, at, key="0/**"):
        self.samples = []
        self.subscriber = at.declare_subscriber(key, self.take)

    def take(self, sample):
        self.samples.append(
            (str(sample.key_expr), sample.payload.to_bytes(), sample.attachment.to_bytes(), time.time())
        )

    def of(self, topic, domain=0):
        return [s for s in self.samples if s[0].startswith(f"{domain}{topic}/")]


def attachment(data):
    """Number, time, identity."""
    assert len(data) == 33 and data[16] == 16, data
    return *struct.unpack("<qq", data[:16]), data[17:]


def tokens(at, domain):
    return {str(r.ok.key_expr) for r in at.liveliness().get(f"@ros2_lv/{domain}/**")}


def ends_with(main, processes):
    """Runs a test and ends this process with its result. Threads of sessions that a failure left open would keep it."""
    code = 0
    try:
        main()
    except BaseException:
        traceback.print_exc()
        code = 1
    sys.stdout.flush()
    sys.stderr.flush()
    for process in processes:
        process.kill()
    # Servers end here.
    atexit._run_exitfuncs()
    os._exit(code)
