"""In: the program, a simulated station, docs/openapi.json. Out: failure if a client that openapi-python-client generates from
that description cannot scan and find a part, or if an answer differs from what the description says.
Frame and unit: mm."""

import importlib
import json
import os
import subprocess
import sys
import tempfile

from server import Server
from waits import until

program, folder, description = sys.argv[1:4]
generator = os.path.join(os.path.dirname(sys.executable), "openapi-python-client")
if not os.path.exists(generator):
    print("openapi-python-client is missing (make python)")
    sys.exit(77)

made = tempfile.mkdtemp()
command = [generator, "generate", "--path", description, "--meta", "none", "--output-path", os.path.join(made, "made")]
done = subprocess.run(command, capture_output=True, text=True, timeout=300)
assert done.returncode == 0, done.stdout + done.stderr
# A picture is a file, which the generator does not type. Everything else of the description becomes code.
omitted = [line for line in (done.stdout + done.stderr).splitlines() if line.startswith(("Cannot", "Unable", "Attempted"))]
assert len(omitted) == 1 and "image/png" in omitted[0], done.stdout + done.stderr

sys.path.insert(0, made)
import attrs  # noqa: E402
from made import AuthenticatedClient  # noqa: E402
from made import models  # noqa: E402


def operation(name):
    return importlib.import_module(f"made.api.default.{name}")


def unknown(value):
    """Keys of an answer, and of what is in it, that the description does not name."""
    if isinstance(value, list):
        return [key for item in value for key in unknown(item)]
    if not hasattr(value, "to_dict"):
        return []
    names = [field.name for field in attrs.fields(type(value))]
    # A map has keys of its own; a message has none but those that are described.
    here = [] if names == ["additional_properties"] else list(getattr(value, "additional_properties", ()))
    return here + [key for name in names if name != "additional_properties" for key in unknown(getattr(value, name))]


def at_paths():
    """Every GET of JSON without values in its path: the operation's name and the path."""
    with open(description) as f:
        paths = json.load(f)["paths"]
    for path, methods in paths.items():
        # A WebSocket answers no plain request.
        get = None if path.endswith("/events") else methods.get("get")
        if get and not [p for p in get["parameters"] if p["required"]]:
            schema = get["responses"]["200"]["content"].get("application/json", {}).get("schema", {})
            if "$ref" in schema or schema.get("type") == "array":
                yield get["operationId"], path


s = Server(program, folder, "--recordings", folder)
try:
    client = AuthenticatedClient(base_url=f"http://{s.host}", token=s.token, raise_on_unexpected_status=True)
    tab = {"client": client, "x_sheetlight_tab": "generated"}

    lease = operation("post_lease").sync(body=models.TakeLease.from_dict({}), **tab)
    assert isinstance(lease, models.Lease) and lease.seconds_left > 30, lease

    def ended(order):
        job = operation("post_jobs").sync(body=order, **tab)
        assert isinstance(job, models.Job), job
        get = lambda: operation("get_jobs_id").sync(job.id, client=client)
        return until(f"{job.id} has ended", lambda: (job := get()).state not in ("queued", "running") and job)

    scan = ended(models.OrderScan(procedure="scan", recording="scan", skip_bad=True))
    assert scan.state == "done" and isinstance(scan.outcome, models.OutcomeScan), scan
    assert scan.outcome.points > 10_000 and 0 < scan.outcome.median_sigma_mm < 0.1, scan.outcome
    found = ended(models.OrderFind(procedure="find", scans=[scan.id], recipe="led"))
    assert isinstance(found.outcome, models.OutcomeFind) and found.outcome.passed, found
    cloud = operation("get_jobs_id_files_name").sync_detailed(scan.id, "scan/cloud.ply", client=client)
    assert cloud.status_code == 200 and cloud.content.startswith(b"ply"), cloud.status_code

    # A fault is a message too.
    lost = operation("get_jobs_id").sync("9999-scan", client=client)
    assert isinstance(lost, models.Fault) and "9999-scan" in lost.error.what, lost
    wrong = ended(models.OrderScan(procedure="scan", recording="scna"))
    assert wrong.state == "failed" and "scna" in wrong.problem.what, wrong

    # What the client makes of an answer is the answer: no value is unknown to the description or missing.
    compared = 0
    for name, path in at_paths():
        answer = operation(name).sync_detailed(client=client)
        raw = json.loads(answer.content)
        assert answer.status_code == 200 or isinstance(answer.parsed, models.Fault), f"{path}: {answer}"
        whole = [a.to_dict() for a in answer.parsed] if isinstance(answer.parsed, list) else answer.parsed.to_dict()
        assert whole == raw, f"{path}: {whole} is not {raw}"
        assert not unknown(answer.parsed), f"{path}: {unknown(answer.parsed)}"
        compared += 1
    assert compared >= 10, compared
    print(f"{compared} answers are as described")
finally:
    s.end()
