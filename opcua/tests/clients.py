"""In: addresses. Out: the program sheetlight-opcua as a process, and a client of it by asyncua, which shares no code
with it.
Frame and unit: s."""

import asyncio
import atexit
import logging
import math
import os
import socket
import subprocess
import threading
import time

from waits import PATIENCE

# It tells of every name that it has twice.
logging.getLogger("asyncua").setLevel(logging.CRITICAL)
OWN, VISION = "urn:sheetlight:vision", "http://opcfoundation.org/UA/MachineVision"
# The parts of a result's content, by their names as variables.
CONTENT = [
    "Found",
    "Pose",
    "Approach",
    "Retract",
    "SigmaMm",
    "SigmaDeg",
    "GatesJudged",
    "GatesPassed",
    "Score",
    "Error",
    "ErrorWords",
]
INNER = "VisionStateMachine.AutomaticModeStateMachine"


def present():
    """Whether the package is here."""
    try:
        import asyncua  # noqa: F401
    except ImportError:
        return False
    return True


async def settled(holds, seconds=PATIENCE):
    """Calls `holds` until it returns something true, and returns that."""
    end = time.monotonic() + seconds
    while True:
        value = holds()
        if asyncio.iscoroutine(value):
            value = await value
        if value:
            return value
        assert time.monotonic() < end, f"not within {seconds} s"
        await asyncio.sleep(0.03)


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as free:
        return free.getsockname()[1]


def same(a, b):
    if isinstance(a, list):
        return isinstance(b, list) and len(a) == len(b) and all(same(x, y) for x, y in zip(a, b))
    return a == b or isinstance(a, float) and math.isnan(a) and math.isnan(b)


def doubles(numbers):
    from asyncua import ua

    return ua.Variant([float(x) for x in numbers], ua.VariantType.Double, is_array=True)


def hello(url):
    """The first message of a connection [OPC 10000-6, 7.1.2.3]."""
    text = url.encode()
    numbers = b"".join(n.to_bytes(4, "little") for n in (0, 65535, 65535, 0, 0, len(text)))
    return b"HELF" + (8 + len(numbers) + len(text)).to_bytes(4, "little") + numbers + text


def certificate(folder):
    """A client's certificate with its key, as openssl makes them."""
    key, pem, der = (os.path.join(folder, f"client{e}") for e in ("-key.pem", ".pem", ".der"))
    more = [
        "-addext",
        "subjectAltName=URI:urn:client:test,DNS:localhost",
        "-addext",
        "keyUsage=digitalSignature,nonRepudiation,keyEncipherment,dataEncipherment",
        "-addext",
        "extendedKeyUsage=clientAuth",
    ]
    subprocess.run(
        [
            "openssl",
            "req",
            "-x509",
            "-newkey",
            "rsa:2048",
            "-nodes",
            "-days",
            "30",
            "-subj",
            "/CN=client",
            "-keyout",
            key,
            "-out",
            pem,
            *more,
        ],
        check=True,
        capture_output=True,
    )
    subprocess.run(["openssl", "x509", "-in", pem, "-outform", "der", "-out", der], check=True, capture_output=True)
    return der, key


class Gateway:
    """`sheetlight-opcua` on any free port."""

    def __init__(self, program, station, *more):
        self.process = subprocess.Popen(
            [program, "--station", station, "--listen", "opc.tcp://127.0.0.1:0", *more],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        # A test that fails leaves no server behind.
        atexit.register(self.process.kill)
        self.lines = []
        threading.Thread(target=lambda: self.lines.extend(self.process.stderr), daemon=True).start()
        first = self.process.stdout.readline()
        assert first.startswith("OPC UA at opc.tcp://127.0.0.1:"), (first, self.said())
        self.port = int(first.split("127.0.0.1:")[1].split("/")[0])
        self.url = f"opc.tcp://127.0.0.1:{self.port}/"

    def said(self):
        return "".join(self.lines)

    def peak_mb(self):
        with open(f"/proc/{self.process.pid}/status") as f:
            return next(int(line.split()[1]) for line in f if line.startswith("VmHWM")) / 1024

    def end(self):
        self.process.terminate()
        return self.process.wait(PATIENCE)


class Seen:
    """What a subscription was told."""

    def __init__(self):
        self.values, self.events = [], []


class Client:
    def __init__(self, url, security=None, user=None, password=None, records=False):
        self.url, self.security, self.user, self.password, self.records = url, security, user, password, records
        self.recorded, self.seen = [], Seen()

    async def __aenter__(self):
        from asyncua import Client as Inner

        self.inner = Inner(self.url, timeout=30)
        self.inner.application_uri = "urn:client:test"
        if self.user:
            self.inner.set_user(self.user)
            self.inner.set_password(self.password)
        if self.security:
            await self.inner.set_security_string(self.security)
        if self.records:
            self.record()
        await self.inner.connect()
        try:
            self.own = await self.inner.get_namespace_index(OWN)
            self.vision = await self.inner.get_namespace_index(VISION)
            from asyncua import ua

            # asyncua finds simple types by their names, and the core namespace has a TrimmedString too.
            ua.register_basetype("TrimmedString", ua.NodeId(3017, self.vision), ua.String)
            # The structures are made from what the server says of them.
            await self.inner.load_data_type_definitions()
        except BaseException:
            await self.inner.disconnect()
            raise
        return self

    async def __aexit__(self, *_):
        await self.inner.disconnect()

    def record(self):
        """Keeps what this client sends from its first byte on, for the test that changes it."""
        connect = self.inner.uaclient.connect_socket

        async def connected(*words, **more):
            await connect(*words, **more)
            transport = self.inner.uaclient.protocol.transport
            write = transport.write

            def kept(data):
                self.recorded.append(bytes(data))
                write(data)

            transport.write = kept

        self.inner.uaclient.connect_socket = connected

    def node(self, name):
        from asyncua import ua

        return self.inner.get_node(ua.NodeId(f"VisionSystem.{name}", self.own))

    def system(self):
        from asyncua import ua

        return self.inner.get_node(ua.NodeId("VisionSystem", self.own))

    async def call(self, path, *arguments):
        from asyncua import ua

        owner = self.node(path.rsplit(".", 1)[0])
        variants = []
        for a in arguments:
            if a is None:
                a = ua.Variant(None, ua.VariantType.Null)
            elif isinstance(a, bool) or isinstance(a, ua.Variant):
                pass
            elif isinstance(a, int):
                a = ua.Variant(a, ua.VariantType.Int32)
            elif isinstance(a, str):
                a = ua.Variant(a, ua.VariantType.String)
            variants.append(a)
        return await owner.call_method(self.node(path).nodeid, *variants)

    async def shown(self, name):
        return await self.node(f"Station.{name}").read_value()

    async def result(self, name):
        value = await self.node(f"LastResult.{name}").read_value()
        return value

    async def text(self, name):
        """The text of a state; None if it is not active."""
        value = await self.node(name).read_data_value(raise_on_bad_status=False)
        return value.Value.Value.Text if value.StatusCode.is_good() and value.Value.Value is not None else None

    async def state(self):
        return await self.text("VisionStateMachine.CurrentState")

    async def automatic(self):
        return await self.text(f"{INNER}.CurrentState")

    async def last_transition(self):
        return await self.text(f"{INNER}.LastTransition")

    async def until_state(self, state, automatic=None, seconds=PATIENCE):
        end = time.monotonic() + seconds
        while True:
            now = (await self.state(), await self.automatic())
            if now == (state, automatic):
                return
            assert time.monotonic() < end, f"{state} {automatic}: it is {now}"
            await asyncio.sleep(0.03)

    async def until_shown(self, name, holds):
        async def is_so():
            return holds(await self.shown(name))

        await settled(is_so)

    async def until_result(self, job):
        async def is_so():
            return await self.result("ResultId") == job

        await settled(is_so)

    def external(self, name):
        from asyncua import ua

        return ua.RecipeIdExternalDataType(Id=name)

    async def prepare(self, name):
        return await self.call("RecipeManagement.PrepareRecipe", self.external(name), None)

    async def start(self, name, meas=None, part=None, parameters=()):
        from asyncua import ua

        ids = [ua.MeasIdDataType(Id=meas) if meas else None, ua.PartIdDataType(Id=part) if part else None]
        kind = ua.VariantType.String if all(isinstance(p, str) for p in parameters) else ua.VariantType.Double
        words = ua.Variant(list(parameters), kind, is_array=True)
        return await self.call(f"{INNER}.StartSingleJob", *ids, self.external(name), None, words)

    async def continuous(self):
        return await self.call(f"{INNER}.StartContinuous", None, None, None, None, None)

    async def stop(self):
        return await self.call(f"{INNER}.Stop", 0, "a test")

    async def result_of(self, job):
        from asyncua import ua

        return await self.call("ResultManagement.GetResultById", ua.ResultIdDataType(Id=job), 0)

    async def recipes(self, prepared=2):
        from asyncua import ua

        number = lambda n: ua.Variant(n, ua.VariantType.UInt32)
        return await self.call("RecipeManagement.GetRecipeListFiltered", None, None, prepared, number(0), number(0), 0)

    async def results(self, state=0, part="", most=0, start=0):
        from asyncua import ua

        number = lambda n: ua.Variant(n, ua.VariantType.UInt32)
        named = ua.PartIdDataType(Id=part) if part else None
        return await self.call(
            "ResultManagement.GetResultListFiltered",
            state,
            None,
            named,
            None,
            None,
            None,
            None,
            None,
            None,
            number(most),
            number(start),
            0,
        )

    def forget(self):
        """What is told from now on."""
        self.seen = Seen()
        return self.seen

    async def watch(self):
        """Subscribes to states, questions and events."""
        from asyncua import ua

        names = {
            self.node("VisionStateMachine.CurrentState").nodeid: "state",
            self.node(f"{INNER}.CurrentState").nodeid: "automatic",
            self.node("Station.AwaitsConfirmation").nodeid: "asks",
            self.node("Station.Phase").nodeid: "phase",
        }
        kinds = {}
        for name, number in (
            ("JobStartedEventType", 1013),
            ("StateChangedEventType", 1018),
            ("RecipePreparedEventType", 1022),
            ("ReadyEventType", 1023),
            ("ResultReadyEventType", 1024),
        ):
            kinds[ua.NodeId(number, self.vision)] = name

        class Handler:
            def datachange_notification(_, node, value, data):
                # The server begins an item of events with an empty value, too.
                if node.nodeid not in names:
                    return
                self.seen.values.append(
                    (names[node.nodeid], value.Text if isinstance(value, ua.LocalizedText) else value)
                )

            def event_notification(_, event):
                self.seen.events.append((kinds.get(event.EventType, str(event.EventType)), event))

            def status_change_notification(_, status):
                self.seen.values.append(("status", status))

        self.subscription = await self.inner.create_subscription(50, Handler())
        await self.subscription.subscribe_data_change(
            [self.inner.get_node(n) for n in names], queuesize=20, sampling_interval=0
        )
        # Its filter of event types compares node identifiers, which the server does not.
        await self.subscription.subscribe_events(
            self.system(), [self.inner.get_node(n) for n in kinds], queuesize=100, where_clause_generation=False
        )

    async def watch_results(self):
        """Subscribes to one type of event at the server object. Returns what it is told."""
        from asyncua import ua
        from asyncua.common.events import get_filter_from_event_type

        told, kind = [], self.inner.get_node(ua.NodeId(1024, self.vision))
        where = await get_filter_from_event_type([kind], False)
        where.WhereClause.Elements.append(
            ua.ContentFilterElement(
                FilterOperator=ua.FilterOperator.OfType,
                FilterOperands=[ua.LiteralOperand(Value=ua.Variant(kind.nodeid, ua.VariantType.NodeId))],
            )
        )

        class Handler:
            def datachange_notification(_, node, value, data):
                pass

            def event_notification(_, event):
                told.append(event.ResultId.Id)

        subscription = await self.inner.create_subscription(50, Handler())
        await subscription.subscribe_events(self.inner.nodes.server, evfilter=where, queuesize=100)
        return told
