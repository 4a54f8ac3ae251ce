"""Cases on Dask workers: real schedulers, real worker processes on loopback, really killed."""

from __future__ import annotations

import importlib.util
import json
import os
import py_compile
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import psutil
import pytest
from commands import ROOT, with_routes

pytest.importorskip("distributed", reason="dask.distributed is not installed: pip install 'gradient-routes[dask]'")

from distributed import Client, Security

from gradient_routes.bench.cases import case
from gradient_routes.bench.cases.outcome import Outcome
from gradient_routes.bench.cases.settings import Settings
from gradient_routes.bench.execution.cluster.cluster import Cluster
from gradient_routes.bench.execution.cluster.dispatch import Stranded
from gradient_routes.bench.execution.cluster.joining import joined, local
from gradient_routes.bench.execution.cluster.remote import packed
from gradient_routes.bench.execution.sweep import How, run

PATIENCE = 600.0  # [s] however busy the machine: what hangs is ended
QUICK = ("--no-timing", "--json", "--isolate")
IDLE = {  # what Dask does when there is nothing to do: a tenth of a processor for each process
    "DASK_DISTRIBUTED__WORKER__PROFILE__ENABLED": "False",
    "DASK_DISTRIBUTED__ADMIN__SYSTEM_MONITOR__GIL__ENABLED": "False",
    "DASK_DISTRIBUTED__ADMIN__SYSTEM_MONITOR__INTERVAL": "10s",
    "DASK_DISTRIBUTED__ADMIN__TICK__INTERVAL": "500ms",
}
PROBLEMS = '''
import os, pathlib, signal, time
from gradient_routes.problems.bar import Bar

def mark(name):
    with open(name, "a") as file:
        file.write(f"{os.getpid()} {os.getppid()}\\n")

class Mine(Bar):
    pass

class Slow(Bar):
    """Takes forever, but for the second time."""
    def linearize(self, u, p):
        if not pathlib.Path("begun").exists():
            mark("begun")
            time.sleep(300)
        return super().linearize(u, p)

class Endless(Bar):
    def linearize(self, u, p):
        mark("begun")
        time.sleep(300)

class Killer(Bar):
    """No worker survives it."""
    def linearize(self, u, p):
        mark("begun")
        os.kill(os.getppid(), signal.SIGKILL)
        time.sleep(300)
'''


def until(what: Callable[[], object], seconds: float = PATIENCE) -> None:
    deadline = time.monotonic() + seconds
    while not what():
        assert time.monotonic() < deadline, "it does not come"
        time.sleep(0.05)


def pids(folder: Path) -> list[tuple[int, int]]:
    """Of the processes that began a case there, and of their workers."""
    file = folder / "begun"
    lines = file.read_text().splitlines() if file.exists() else []
    return [(int(line.split()[0]), int(line.split()[1])) for line in lines]


def alive(pid: int) -> bool:
    try:
        return psutil.Process(pid).status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False


@contextmanager
def started(*arguments: str, **environment: str) -> Iterator[subprocess.Popen[bytes]]:
    process = subprocess.Popen(
        [sys.executable, "-m", *arguments],
        env=with_routes() | IDLE | environment,
        cwd="/",
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    try:
        yield process
    finally:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()


class Site:
    """A scheduler, and workers as they are asked for."""

    def __init__(self, folder: Path, stack: ExitStack, **environment: str) -> None:
        file = folder / "scheduler.json"
        arguments = ("--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", str(file))
        self.scheduler = stack.enter_context(started("distributed.cli.dask_scheduler", *arguments, **environment))
        until(lambda: file.exists() and file.read_text().strip().endswith("}"))  # it is not written at once
        self.address = json.loads(file.read_text())["address"]

    @contextmanager
    def workers(self, count: int, *options: str, **environment: str) -> Iterator[None]:
        """So many more of them."""
        words = ("distributed.cli.dask_worker", self.address, "--host", "127.0.0.1", "--no-dashboard", *options)
        with Client(self.address, set_as_default=False) as client, ExitStack() as stack:
            for _ in range(count):
                stack.enter_context(started(*words, "--nthreads", "2", **environment))
            until(lambda: len(client.nthreads()) == count)
            yield
            stack.close()
            until(lambda: not client.nthreads())


@contextmanager
def site(folder: Path, **environment: str) -> Iterator[Site]:
    with ExitStack() as stack:
        yield Site(folder, stack, **environment)


def other_version(folder: Path) -> None:
    info = folder / "gradient_routes-9.9.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: gradient-routes\nVersion: 9.9\n")


def no_package(folder: Path) -> None:
    (folder / "gradient_routes.py").write_text("")


def other_dask(folder: Path) -> None:
    info = folder / "distributed-9.9.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: distributed\nVersion: 9.9\n")


def before_others(folder: Path) -> str:
    """For PYTHONPATH."""
    return os.pathsep.join([str(folder), *filter(None, [os.environ.get("PYTHONPATH")])])


@pytest.fixture(autouse=True)
def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """A scheduler that is there answers, however busy the machine."""
    monkeypatch.setattr("gradient_routes.bench.execution.cluster.joining.TIMEOUT", PATIENCE)


@pytest.fixture(scope="module")
def pair(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The address of a scheduler that cannot import this project, with two workers that no test harms."""
    folder = tmp_path_factory.mktemp("pair")
    no_package(folder)
    with site(folder, PYTHONPATH=before_others(folder)) as made, made.workers(2, "--no-nanny"):
        yield made.address


@pytest.fixture(scope="module")
def lone(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Site]:
    """A scheduler that has no workers yet."""
    with site(tmp_path_factory.mktemp("lone")) as made:
        yield made


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "odd.py").write_text(PROBLEMS)
    return tmp_path


def command(*arguments: str, address: str | None = None, route: str = "adjoint") -> list[str]:
    where = ["--executor", "dask", *(["--scheduler", address] if address else [])]
    problems = [word for problem in arguments if not problem.startswith("-") for word in ("--problem", problem)]
    options = [argument for argument in arguments if argument.startswith("-")]
    return ["run", *problems, "--route", route, *where, *options]


@pytest.fixture
def launched(folder: Path) -> Iterator[Callable[..., subprocess.Popen[str]]]:
    """`routes`, in a process of its own that does not outlive the test."""
    with ExitStack() as stack:

        def launch(words: list[str]) -> subprocess.Popen[str]:
            pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
            words = ["routes", *words]
            process = subprocess.Popen(words, cwd=folder, env=with_routes(), start_new_session=True, **pipes)
            stack.enter_context(process)
            stack.callback(process.kill)
            return process

        yield launch


def test_a_killed_workers_case_is_done_by_another(lone: Site, folder: Path, launched, cli) -> None:
    sweep = ("bar[n=4]", "odd.py:Slow", *QUICK)
    with lone.workers(2, "--no-nanny"):
        running = launched(command(*sweep, address=lone.address))
        until(lambda: pids(folder))
        ((inside, worker),) = pids(folder)
        os.kill(worker, signal.SIGKILL)
        until(lambda: not alive(inside))
        out, err = running.communicate(timeout=PATIENCE)
        rows = [json.loads(line) for line in out.splitlines()]
        assert (running.returncode, err) == (0, "")
        assert [row["status"] for row in rows] == ["ok"] * 2
        assert {row["host"] for row in rows} == {os.uname().nodename}
        (slow,) = [row for row in rows if row["problem"] == "odd.py:Slow"]
        assert "begun 2 times, workers were lost: tcp://127.0.0.1:" in slow["note"]
        resumed = cli(*command(*sweep, "--resume", address=lone.address))
        assert (resumed.code, resumed.rows) == (0, [])
    problems = ("--problem", "bar[n=4]", "--problem", "odd.py:Slow")
    here = cli("run", *problems, "--route", "adjoint", "--no-timing", "--json")
    for key in ("case_key", "content_key", "objective", "gradient", "settings"):
        assert {str(row[key]) for row in rows} == {str(row[key]) for row in here.rows}
    assert rows[0].keys() == here.rows[0].keys()


def test_a_case_that_kills_its_workers_is_given_up(lone: Site, folder: Path, launched) -> None:
    with lone.workers(1, "--nanny"):  # which replaces it as often as it is killed
        running = launched(command("odd.py:Killer", "bar[n=4]", *QUICK, address=lone.address))
        out, err = running.communicate(timeout=2 * PATIENCE)
        rows = {row["problem"] + str(row["n_param"]): row for row in map(json.loads, out.splitlines())}
        assert (running.returncode, err) == (1, "")
        assert rows["bar4"]["status"] == "ok"
        killer = rows["odd.py:KillerNone"]
        assert killer["status"] == "crashed"
        assert killer["reason"].startswith("adjoint: 3 workers were lost with it: tcp://127.0.0.1:")
        assert killer["host"] == os.uname().nodename
        assert len(pids(folder)) == len({worker for _, worker in pids(folder)}) == 3
        until(lambda: not any(alive(inside) for inside, _ in pids(folder)))


@pytest.mark.parametrize("ending", [signal.SIGINT, signal.SIGKILL], ids=lambda ending: ending.name)
def test_what_nobody_waits_for_ends_on_its_worker(ending: signal.Signals, pair: str, folder: Path, launched) -> None:
    running = launched(command("odd.py:Endless", "--no-timing", address=pair))
    until(lambda: pids(folder))
    running.send_signal(ending)
    _, err = running.communicate(timeout=PATIENCE)
    ((inside, worker),) = pids(folder)
    until(lambda: not alive(inside))
    assert alive(worker)
    if ending != signal.SIGKILL:
        assert running.returncode == 130
        assert err.startswith("routes: interrupted - ")
        assert err.count("\n") == 1


def test_a_cluster_of_this_machine_ends_with_the_sweep(folder: Path, launched) -> None:
    running = launched(command("bar[n=4]", "odd.py:Endless", "--no-timing", "--workers=1", "--json"))
    first = running.stdout.readline()
    until(lambda: pids(folder))
    family = psutil.Process(running.pid).children(recursive=True)
    os.killpg(running.pid, signal.SIGINT)  # as a terminal does
    out, err = running.communicate(timeout=PATIENCE)
    assert (running.returncode, out) == (130, "")
    assert (err.startswith("routes: interrupted - "), err.count("\n")) == (True, 1)
    assert json.loads(first)["status"] == "ok"
    until(lambda: not any(process.is_running() for process in family))


def test_of_workers_on_one_host_one_times(pair: str, cli) -> None:
    ran = cli(*command("bar[n=4|5]", "--json", "--min-time=0", "--isolate", address=pair))
    assert [row["status"] for row in ran.rows] == ["ok", "ok"]
    assert all(row["seconds"] > 0 < row["forward_s"] for row in ran.rows)
    (line,) = ran.err.splitlines()
    assert line.startswith("routes: 1 of 2 Dask workers left idle: they share a host")
    first, second = sorted(ran.rows, key=lambda row: row["started"])
    assert first["started"] < second["started"]


def elsewhere(folder: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Cases run there, as if this folder were another one on the other host."""
    monkeypatch.setattr(
        "gradient_routes.bench.execution.cluster.dispatch.packed",
        lambda case, limits, cwd: packed(case, limits, folder),
    )


def test_a_host_without_the_folder_says_so(pair: str, cli, monkeypatch: pytest.MonkeyPatch) -> None:
    elsewhere("/nowhere", monkeypatch)
    (row,) = cli(*command("bar", *QUICK, address=pair)).rows
    assert row["status"] == "failed"
    assert row["reason"].startswith(f"adjoint: no folder /nowhere on {os.uname().nodename} - start from one that")


CHANGES: dict[int, tuple[Callable[[Path], object], str]] = {
    2: (lambda copy: (copy / "odd.py").unlink(), "no file odd.py"),
    3: (lambda copy: (copy / "odd.py").write_text(PROBLEMS + "\n# newer"), "its code, data or libraries are others"),
    4: (lambda copy: (copy / "d.csv").unlink(), "no file d.csv in "),
    5: (lambda copy: (copy / "d.csv").write_text("node,displacement\n2,3.0\n"), "its code, data or libraries are"),
}


def test_a_host_with_other_files_does_not_answer_for_these(
    pair: str, cli, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Case n runs where change n was made."""
    (folder / "d.csv").write_text("node,displacement\n2,1.0\n")
    for n, (change, _) in CHANGES.items():
        there = folder / f"there{n}"
        there.mkdir()
        for name in ("odd.py", "d.csv"):
            (there / name).write_bytes((folder / name).read_bytes())
        change(there)
    monkeypatch.setattr(
        "gradient_routes.bench.execution.cluster.dispatch.packed",
        lambda case, limits, cwd: packed(case, limits, str(folder / f"there{case.asked['problem_options']['n']}")),
    )
    ran = cli(*command(f"odd.py:Mine[n={'|'.join(map(str, CHANGES))},data=d.csv]", *QUICK, address=pair))
    rows = {row["problem_options"]["n"]: row for row in ran.rows}
    assert rows.keys() == CHANGES.keys()
    for n, (_, reason) in CHANGES.items():
        assert rows[n]["status"] == "failed"
        assert rows[n]["reason"].startswith(f"adjoint on {os.uname().nodename}: ")
        assert reason in rows[n]["reason"]


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (other_version, "has gradient-routes 9.9 (here 0.1.0)"),
        (no_package, "does not report its versions: ModuleNotFoundError"),
    ],
)
def test_a_worker_that_differs_is_refused(
    spoil: Callable[[Path], None], said: str, lone: Site, tmp_path: Path, cli
) -> None:
    spoilt = tmp_path / "spoilt"
    spoilt.mkdir()
    spoil(spoilt)
    with lone.workers(1, "--no-nanny", PYTHONPATH=before_others(spoilt)):
        ran = cli(*command("bar", *QUICK, address=lone.address))
    assert (ran.code, ran.out) == (2, "")
    assert ran.err.startswith("routes: Dask worker tcp://127.0.0.1:")
    assert said in ran.err
    assert ran.err.endswith(" - install the same there, gradient-routes 0.1.0\n")


def test_a_scheduler_of_another_dask_is_refused(tmp_path: Path, cli) -> None:
    other_dask(tmp_path)
    with site(tmp_path, PYTHONPATH=before_others(tmp_path)) as made:
        ran = cli(*command("bar", *QUICK, address=made.address))
    assert (ran.code, ran.out) == (2, "")
    assert ran.err.startswith(f"routes: --scheduler {made.address}: has distributed 9.9 (here ")
    assert ran.err.count("\n") == 1


def test_what_a_worker_cannot_read_is_a_row(pair: str, cli, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gradient_routes.bench.execution.cluster.dispatch.packed", lambda *case: b"no pickle")
    (row,) = cli(*command("bar", *QUICK, address=pair)).rows
    assert row["status"] == "failed"
    assert row["reason"].startswith("adjoint on worker tcp://127.0.0.1:")
    assert "UnpicklingError" in row["reason"]


def outcomes(address: str, patience: float, clients: list[Client] | None = None) -> Iterator[Outcome]:
    @contextmanager
    def connect() -> Iterator[Client]:
        with joined(address) as client:
            if clients is not None:
                clients.append(client)
            yield client

    cluster = Cluster(connect, False, pytest.fail, patience)
    specs = case.problems(["bar[n=4]", "odd.py:Endless"])
    return run(specs, case.routes(["adjoint"]), Settings("start", 60.0, 0.0, False), How(cluster=cluster))


def test_workers_that_do_not_come_are_not_waited_for(lone: Site, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    with pytest.raises(Stranded, match=rf"no worker for 1 s, .* - start some: dask worker {lone.address} --nthreads 1"):
        next(outcomes(lone.address, 1.0))


def test_a_scheduler_that_goes_is_told(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    clients: list[Client] = []
    with ExitStack() as workers, site(folder) as made:
        workers.enter_context(started("distributed.cli.dask_worker", made.address, "--no-dashboard", "--no-nanny"))
        going = outcomes(made.address, PATIENCE, clients)
        assert next(going).row["status"] == "ok"
        clients[0]._timeout = 0.5  # [s] in which it connects again
        made.scheduler.kill()
        with pytest.raises(Stranded, match=f"Dask scheduler {made.address}: does not answer, with 1 case under way"):
            next(going)
        until(lambda: not any(alive(inside) for inside, _ in pids(folder)))


def pem(folder: Path) -> dict[str, str]:
    """Files of an authority, a certificate and its key, by the names that options of Dask and of this project have."""
    made = Security.temporary()
    folder.mkdir()
    files = {"ca-file": made.tls_ca_file, "cert": made.tls_client_cert, "key": made.tls_client_key}
    for name, content in files.items():
        (folder / f"{name}.pem").write_text(content)
    return {f"--tls-{name}": str(folder / f"{name}.pem") for name in files}


def words(options: dict[str, str]) -> list[str]:
    return [f"{name}={value}" for name, value in options.items()]


def test_a_cluster_of_this_machine_refuses_who_has_no_credentials_of_it(
    tmp_path: Path, cli, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Any user of the machine can connect to its port."""
    with local(1) as client:
        address = client.scheduler.address
        assert address.startswith("tls://127.0.0.1:")
        for security in (None, Security.temporary()):
            with pytest.raises((OSError, TypeError)):
                Client(address, timeout=PATIENCE, set_as_default=False, security=security)
        with pytest.raises((OSError, RuntimeError)):
            Client(address.replace("tls", "tcp"), timeout=3, set_as_default=False)
        monkeypatch.setattr("gradient_routes.bench.execution.cluster.joining.TIMEOUT", 3.0)
        for options in ([], words(pem(tmp_path / "others"))):
            ran = cli(*command("bar", *QUICK, *options, address=address))
            assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
            assert ran.err.startswith(f"routes: --scheduler {address}: no Dask scheduler answers within 3 s (")
            assert ran.err.endswith(" - give the --tls-ca-file, --tls-cert and --tls-key of its cluster\n")
        assert client.submit(os.getpid).result(timeout=PATIENCE) != os.getpid(), "it works for whom it is for"


def test_a_cluster_by_tls_takes_the_credentials_from_files(tmp_path: Path, cli) -> None:
    """`dask scheduler` and `dask worker` call the same files by the same names."""
    ours, file = pem(tmp_path / "ours"), tmp_path / "scheduler.json"
    dask = ("--host", "127.0.0.1", "--no-dashboard", *words(ours))
    with ExitStack() as stack:
        at = ("--protocol", "tls", "--port", "0", "--scheduler-file", str(file))
        stack.enter_context(started("distributed.cli.dask_scheduler", *at, *dask))
        until(lambda: file.exists() and file.read_text().strip().endswith("}"))
        address = json.loads(file.read_text())["address"]
        stack.enter_context(started("distributed.cli.dask_worker", address, *dask, "--no-nanny"))
        ran = cli(*command("bar[n=4]", *QUICK, *words(ours), address=address))
        assert (ran.code, [row["status"] for row in ran.rows]) == (0, ["ok"]), ran.err
        refused = cli(*command("bar[n=4]", *QUICK, *words(pem(tmp_path / "others")), address=address))
        assert (refused.code, refused.out, refused.err.count("\n")) == (2, "", 1)


def test_without_what_makes_certificates_it_is_said_how_to_install_it(cli, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cryptography", None)
    ran = cli(*command("bar", *QUICK))
    assert (ran.code, ran.out, ran.err.count("\n")) == (2, "", 1)
    assert ran.err.endswith(" - pip install 'gradient-routes[dask]'\n")


REFUSED = {
    "--tls-cert=/dev/null": "--tls-cert: is of --executor dask - leave it out",
    "--executor=dask --tls-cert=/dev/null": "--tls-cert: of a cluster at --scheduler, this one makes its own",
    "--executor=dask --scheduler=tls://h:1 --tls-cert=/dev/null": "--tls-ca-file, --tls-cert: go together - give both",
    "--executor=dask --scheduler=tls://h:1 --tls-ca-file=/dev/null --tls-cert=/dev/null": "--scheduler tls://h:1: no ",
    "--scheduler=tcp://h:1": "--scheduler: is of --executor dask - leave it out",
    "--workers=2": "--workers: is of --executor dask - leave it out",
    "--executor=dask --jobs=2": "--jobs: is of --executor local, a Dask cluster has workers - leave it out",
    "--executor=dask --no-isolate": "--executor dask: cases on its workers run in processes of their own",
    "--executor=dask --workers=0": "--workers 0 - give a whole number from 1 to 4096",
    "--executor=dask --workers=2": "--workers 2: cases side by side spoil each other's timing - add --no-timing",
    "--executor=dask --workers=2 --scheduler=tcp://h:1": "--workers: of a cluster of this machine",
    "--executor=dask --scheduler=nonsense://x": "--scheduler nonsense://x: no Dask scheduler answers within 10 s",
    "--executor=dask --scheduler=tcp://127.0.0.1:1": "--scheduler tcp://127.0.0.1:1: no Dask scheduler answers",
}


@pytest.mark.parametrize("options", REFUSED)
def test_what_does_not_go_together_is_refused_in_a_line(options: str, cli, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gradient_routes.bench.execution.cluster.joining.TIMEOUT", 1.0 if "127" in options else 10.0)
    isolate = [] if "isolate" in options else ["--isolate"]
    ran = cli("run", "--problem", "bar", "--route", "adjoint", "--no-store", *options.split(), *isolate)
    assert (ran.code, ran.out) == (2, "")
    assert ran.err.startswith(f"routes: {REFUSED[options]}")
    assert ran.err.count("\n") == 1


def test_without_dask_it_is_said_how_to_install_it(folder: Path) -> None:
    code = "import sys; sys.modules['distributed'] = None; from gradient_routes.bench.cli import main; main()"
    words = [sys.executable, "-c", code, *command("bar")]
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True, timeout=PATIENCE)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.endswith(" - pip install 'gradient-routes[dask]'\n")
    assert done.stderr.count("\n") == 1


def test_the_slurm_example_asks_for_workers() -> None:
    file = ROOT / "examples" / "cluster" / "slurm.py"
    py_compile.compile(str(file), doraise=True)
    handler = signal.getsignal(signal.SIGINT)
    pytest.importorskip("dask_jobqueue", reason="dask-jobqueue is not installed")
    signal.signal(signal.SIGINT, handler)  # importing it replaces Python's handler: other tests would not see Ctrl-C
    spec = importlib.util.spec_from_file_location("slurm", file)
    assert spec is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    with module.cluster() as cluster:
        script = cluster.job_script()
    assert "#SBATCH --exclusive" in script
    assert f"{sys.executable} -m distributed.cli.dask_worker tcp://" in script
