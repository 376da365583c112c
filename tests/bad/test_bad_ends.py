"""How a run ends that cannot write, whose reader has gone, or that was killed: what is kept stays, litter goes."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import shapely
from typer.testing import CliRunner

from chipload import cli
from chipload.cli import app
from chipload.errors import InputError, OutputError
from chipload.examples import copy_example
from chipload.files import FRESH, fresh_folder, sweep, write_whole
from chipload.report import folder
from chipload.report.folder import check_target
from chipload.simulation.checkpoint import LAST, Checkpoint
from chipload.stock.layers import LayeredStock
from chipload.terminal import plain
from slot_job import slot_job

CLI = "from chipload.cli import main; main()"


def command(*words: str | Path, **how: object) -> subprocess.CompletedProcess[str]:
    given = {"capture_output": True, "text": True, "timeout": 300, **how}
    return subprocess.run([sys.executable, "-c", CLI, *map(str, words)], check=False, **given)  # type: ignore[call-overload, no-any-return]


@pytest.fixture
def bracket(tmp_path: Path) -> Path:
    """A job that is read only, which ends in a moment."""
    copy_example("notebooks", tmp_path / "job")
    (tmp_path / "read.toml").write_text(
        '[program]\nfile = "job/corner.ngc"\n[machine]\nname = "vmc"\n', encoding="utf-8"
    )
    return tmp_path / "read.toml"


# -- item 22: names and stdout ----------------------------------------------------------------------------------
def test_a_result_with_a_name_of_250_characters(bracket: Path) -> None:
    done = command("run", bracket, "--out", bracket.parent / ("a" * 250))
    assert done.returncode == 4
    assert done.stderr.endswith("cannot be written: File name too long: name another place\n")
    assert "Traceback" not in done.stderr


def test_stdout_that_nobody_reads(bracket: Path) -> None:
    source, sink = os.pipe()
    os.close(source)
    done = command("check", bracket, stdout=sink, capture_output=False, stderr=subprocess.PIPE)
    os.close(sink)
    assert (done.returncode, done.stderr) == (4, "")


def test_stdout_that_is_closed(bracket: Path) -> None:
    done = command("check", bracket, stdout=None, capture_output=False, stderr=subprocess.PIPE,
                   preexec_fn=lambda: os.close(1))  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device that is full")
def test_stdout_that_is_full(bracket: Path) -> None:
    with Path("/dev/full").open("w") as full:
        done = command("check", bracket, stdout=full, capture_output=False, stderr=subprocess.PIPE)
    assert done.returncode == 4
    assert done.stderr == (
        "chipload: stdout: cannot be written: No space left on device: free space; the same command continues\n"
    )


# -- item 23: control bytes -------------------------------------------------------------------------------------
def test_a_program_does_not_command_the_terminal(tmp_path: Path) -> None:
    path = tmp_path / "a.ngc"
    path.write_bytes(b"G21 G90\n(MSG, \x1b]0;gone\x07\x1b[2J\xc2\x9b31m)\nM\x1b[2J\nG0 X1\nM2\n")
    done = command("check", path, "--machine", "vmc")
    assert not any(c < " " and c != "\n" for c in done.stdout + done.stderr)
    assert "\x9b" not in done.stdout + done.stderr


def test_text_without_commands() -> None:
    assert plain("a\tb\n") == "a\tb\n"
    assert plain("\x1b[31m\x00\x7f\x9b\u202e") == "\\x1b[31m\\x00\\x7f\\x9b\\u202e"
    assert plain("5 µm – ½ °") == "5 µm – ½ °"


# -- item 23: what killed runs leave ----------------------------------------------------------------------------
def test_what_a_killed_run_left_goes_with_the_next(tmp_path: Path) -> None:
    code = (
        "import os, sys\n"
        "from pathlib import Path\n"
        "from chipload.files import fresh_folder\n"
        "with fresh_folder(Path(sys.argv[1])) as folder:\n"
        "    (folder / 'summary.json').write_text('{}')\n"
        "    print('made', flush=True)\n"
        "    os.read(0, 1)\n"
    )
    alive = subprocess.Popen([sys.executable, "-c", code, str(tmp_path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    assert alive.stdout is not None
    assert alive.stdin is not None
    assert alive.stdout.readline() == b"made\n"
    (of_a_running_one,) = tmp_path.glob(f"{FRESH}*")
    killed = subprocess.Popen(
        [sys.executable, "-c", code, str(tmp_path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )
    assert killed.stdout is not None
    assert killed.stdout.readline() == b"made\n"
    killed.send_signal(signal.SIGKILL)
    killed.wait()
    assert len(list(tmp_path.glob(f"{FRESH}*"))) == 2
    check_target(tmp_path / "result")
    assert list(tmp_path.glob(f"{FRESH}*")) == [of_a_running_one]
    alive.stdin.close()
    alive.wait()
    for process in (alive, killed):
        for pipe in (process.stdin, process.stdout):
            assert pipe is not None
            pipe.close()
    assert list(tmp_path.iterdir()) == []


def test_what_is_not_ours_stays(tmp_path: Path) -> None:
    (tmp_path / ".chipload-notes").mkdir()
    (tmp_path / ".chipload-backup.tar").write_text("x")
    (tmp_path / ".chipload-abcdefgh").symlink_to(tmp_path / ".chipload-notes")
    os.mkfifo(tmp_path / ".chipload-abcdefgi")
    (tmp_path / ".chipload-abcdefgj").write_text("half of a file")
    sweep(tmp_path)
    assert sorted(p.name for p in tmp_path.iterdir()) == [
        ".chipload-abcdefgh", ".chipload-abcdefgi", ".chipload-backup.tar", ".chipload-notes",
    ]  # fmt: skip


def test_an_exchange_of_folders_leaves_no_moment_without_a_result(tmp_path: Path) -> None:
    """Of a swap either the old or the new result is there; afterwards nothing else."""
    from chipload.report.folder import _swap

    (tmp_path / "result").mkdir()
    (tmp_path / "result" / "old").write_text("")
    with fresh_folder(tmp_path) as folder:
        (folder / "new").write_text("")
        _swap(folder, tmp_path / "result")
    assert [p.name for p in (tmp_path / "result").iterdir()] == ["new"]
    assert [p.name for p in tmp_path.iterdir()] == ["result"]


# -- item 23: the worker of the page ----------------------------------------------------------------------------
def test_the_worker_ends_with_its_own_code(bracket: Path) -> None:
    """Its input stays open, as the page holds it: it ended with SIGABRT."""
    words = [sys.executable, "-m", "chipload.web.worker", str(bracket), str(bracket.parent / "result")]
    source, sink = os.pipe()
    try:
        done = subprocess.run(words, stdin=source, capture_output=True, text=True, timeout=300, check=False)
    finally:
        os.close(sink)
        os.close(source)
    assert (done.returncode, done.stderr) == (0, "")
    assert json.loads(done.stdout.splitlines()[-1])["code"] in (0, 3)


# -- item 19: a disk that is full -------------------------------------------------------------------------------
def test_kept_work_stays_where_output_cannot_be_written(tmp_path: Path) -> None:
    def run() -> None:
        with Checkpoint(tmp_path / "u") as kept:
            kept.begin("key")
            kept.add({"x": np.arange(3.0)})
            kept.commit({"stock": b"state"})
            raise OutputError("result: cannot be written: No space left on device")

    with pytest.raises(OutputError):
        run()
    assert (tmp_path / "u" / LAST).exists()
    with Checkpoint(tmp_path / "u") as again:
        assert again.begin("key") is not None
        assert again.safe == 3


def test_input_that_is_refused_before_the_work_begins_leaves_what_was_kept(tmp_path: Path) -> None:
    with Checkpoint(tmp_path / "u") as kept:
        kept.begin("key")
        kept.add({"x": np.arange(3.0)})
        kept.commit({"stock": b"state"})
    with pytest.raises(InputError), Checkpoint(tmp_path / "u"):
        raise InputError("tool 7: no [[cutter]] has this number")
    assert (tmp_path / "u" / LAST).exists()


#: a small job of a capability that goes on where it was stopped, and of one that begins again
SMALL = {
    "slot": (),
    "contour": ('operation.0.strategies=["plain"]', 'operation.0.use="plain"', "operation.0.step_mm=0.5"),
}


@pytest.fixture(params=sorted(SMALL))
def small(request: pytest.FixtureRequest, tmp_path: Path) -> tuple[list[str], Path, bool]:
    """The command of a small job, its result folder, and whether a stopped run goes on."""
    name, out = request.param, tmp_path / "results" / "out"
    job = slot_job(tmp_path / "job") if name == "slot" else copy_example(name, tmp_path / "job") / "job.toml"
    sets = [word for text in SMALL[name] for word in ("--set", text)]
    return ["run", str(job), "--out", str(out), "--keep-s", "0", *sets], out, name == "slot"


def ended_well(words: list[str], out: Path) -> str:
    """What the command says that ends with a result and leaves nothing beside it."""
    done = CliRunner().invoke(app, words)
    assert done.exit_code in (0, 3), done.output
    assert [p.name for p in out.parent.iterdir()] == ["out"]
    return done.output


def test_a_full_disk_ends_with_its_own_code(
    small: tuple[list[str], Path, bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The report cannot be written: what was simulated is kept; with free space the same command continues."""
    words, out, goes_on = small

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(folder, "_write", full)
        ended = CliRunner().invoke(app, words)
    assert ended.exit_code == 4, ended.output
    assert "cannot be written: No space left on device: free space; the same command continues" in ended.output
    assert not out.exists()
    assert (out.with_name("out.unfinished") / LAST).exists() == goes_on
    assert ("continues after step" in ended_well(words, out)) == goes_on


@pytest.mark.parametrize("name", ["SIGTERM", "SIGHUP"])
def test_a_signal_while_the_result_is_written_leaves_no_half_of_it(
    small: tuple[list[str], Path, bool], name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    words, out, goes_on = small
    number = getattr(signal, name)
    monkeypatch.setattr(folder, "_write", lambda *_: os.kill(os.getpid(), number))
    before = signal.signal(number, cli._stop)
    try:
        ended = CliRunner().invoke(app, words)
    finally:
        signal.signal(number, before)
    assert ended.exit_code == 130, ended.output
    left = [p.name for p in out.parent.iterdir()] if out.parent.exists() else []
    assert left == (["out.unfinished"] if goes_on else [])
    monkeypatch.undo()
    assert ("continues after step" in ended_well(words, out)) == goes_on


def test_a_second_run_into_the_same_folder(
    small: tuple[list[str], Path, bool], monkeypatch: pytest.MonkeyPatch
) -> None:
    """While the first writes its result, the same command: refused where work is kept, else each result is whole."""
    words, out, goes_on = small
    ended_well(words, out)
    alone = {p.name: p.read_bytes() for p in out.iterdir()}
    write, codes = folder._write, list[int]()

    def second(*given: object) -> None:
        monkeypatch.setattr(folder, "_write", write)
        codes.append(CliRunner().invoke(app, words).exit_code)
        write(*given)  # type: ignore[arg-type]

    monkeypatch.setattr(folder, "_write", second)
    ended_well(words, out)
    assert codes == [2] if goes_on else codes[0] in (0, 3)
    assert {p.name: p.read_bytes() for p in out.iterdir()} == alone


@pytest.mark.parametrize("when", ["before", "after"])
def test_a_signal_outside_of_the_command_is_no_fault(when: str) -> None:
    """Before the command is read and after it has ended: 130 as at any other moment, without a traceback."""
    code = (
        "import os, signal, sys\n"
        "import chipload.cli as cli\n"
        "app = cli.app\n"
        "def stopped():\n"
        f"    if {when == 'after'}:\n"
        "        try:\n"
        "            app(['--version'])\n"
        "        except SystemExit:\n"
        "            pass\n"
        "    os.kill(os.getpid(), signal.SIGTERM)\n"
        "cli._application = lambda words: stopped\n"
        "cli.main()\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=300, check=False)
    assert (done.returncode, done.stderr) == (130, "")


def test_a_file_that_is_written_whole_says_why_it_cannot(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match=r"a/b: cannot be written: No such file or directory: name another place$"):
        write_whole(tmp_path / "a" / "b", b"")


# -- item 11: a stock can always be read ------------------------------------------------------------------------
def test_a_tile_of_a_polygon_and_slivers(tmp_path: Path) -> None:
    """A cut that the geometry engine answers with a collection of polygons and lines (found among random cuts)."""
    tile, cut = (shapely.from_wkb(bytes.fromhex(text)) for text in SLIVERS)
    assert shapely.get_type_id(shapely.difference(tile, cut)) == 7
    stock = LayeredStock(
        np.array([0.0, 1.0]), np.array([0.0, 10.0]), np.array([0.0, 10.0]), np.array([[[tile]]], dtype=object)
    )
    stock.remove(0, cut)
    left = shapely.area(shapely.difference(tile, cut))
    assert stock.area(0) == pytest.approx(left, rel=1e-12)
    stock.save(tmp_path / "stock.npz")
    again = LayeredStock.load(tmp_path / "stock.npz")
    assert again.to_bytes() == stock.to_bytes()
    assert again.area(0) == pytest.approx(left, rel=1e-12)


def test_a_tile_that_was_such_a_collection_before(tmp_path: Path) -> None:
    tile = shapely.GeometryCollection([shapely.box(0, 0, 4, 4), shapely.LineString([(5, 5), (6, 6)])])
    stock = LayeredStock(
        np.array([0.0, 1.0]), np.array([0.0, 10.0]), np.array([0.0, 10.0]), np.array([[[tile]]], dtype=object)
    )
    stock.save(tmp_path / "stock.npz")
    assert LayeredStock.load(tmp_path / "stock.npz").area(0) == 16.0


SLIVERS = (
    (
        "0106000000030000000103000000010000002500000045F78D6FC8B41D404F93DA333671ED3FA4BE81F03FAD1F4014A84FDB"
        "62C5DF3F77FBA10B752421406FDB6E42F412F43FD716284B39282040824188A536DAFA3FEF566313171B2240D7A8BBC48E7D"
        "0640F2A6031F4A722240B6F18B349C51054017C364321FC023406C6A59FA69620B403F73C426EC682340F920898A5C8E0C40"
        "F8D048A5916E23406B5AC42EA0A80C40953C6FF088C922400B5621D04EE00E40EA5E49A5916E23409FAF253EFAEF1040E100"
        "D6335EEA21403EE8E764A48B13409F807700B03F21407246B5BCAFFE114076215E53C9D420402C87FE878BB61240596049A5"
        "916E2340D25B6CB2F8C218405002D6335EEA214072942ED9A25E1B404769FC7E55452140A0DB1A03D0DE19404CA262C22A66"
        "204084912ED9A25E1B40F9FF101B44821F40A08C1903D0DE1940586CDDA1EEC31D4064472DD9A25E1B4026B6167B44281B40"
        "DA5141F63B561840E8A8FC7A44281B400CB957F63B561840AEE8A4A721941840DC26274A9656154056EF1598DD1F1840FF83"
        "95CF91BA1540A738657133841540D3C9A8EC2AB2124027202198DD1F18406287A2CF91BA154034302FB5761715400CB957F6"
        "3B561840C64205E7471A004006BC890F735802403A5F9F535B530B403DA796FE8263F13F751465FE52D90340000000000000"
        "0000000000000000000000000000000000000000000000000000000000000000244000000000000024400000000000002440"
        "00000000000024400000000000000000955784B3AE051F400000000000000000FDB636593E721C40D4E83639A9B8E13F45F7"
        "8D6FC8B41D404F93DA333671ED3F010300000001000000040000001F888F362E82174000000000000000004C12940F7B1418"
        "40990FB1DE0F44C53F3D56379B50DA184000000000000000001F888F362E8217400000000000000000010300000001000000"
        "040000000BC12D3C5880154089DE12643E89B13F8D9850B8E9D115400000000000000000B5233B2F06441540000000000000"
        "00000BC12D3C5880154089DE12643E89B13F"
    ),
    (
        "01030000000100000005000000D04890AD16EE20407E621082F0880A40F564F1C0EB3B22409AEDEE23DF4C104080D847F63B"
        "561840C1CEF7BE87BB1A4036A085CF91BA1540661211DC20B31740D04890AD16EE20407E621082F0880A40"
    ),
)
