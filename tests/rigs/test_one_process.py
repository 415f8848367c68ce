"""One process at a time works on a bundle; the lock ends with its process, however that ends."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import pytest

from rigs.errors import JobError
from rigs.one_process import one_at_a_time

HOLD = (
    "import sys, time; from pathlib import Path; from rigs.one_process import one_at_a_time\n"
    "with one_at_a_time(Path(sys.argv[1])):\n    print('held', flush=True); time.sleep(60)\n"
)


@pytest.mark.skipif(sys.platform == "win32", reason="there the exclusive port is what keeps a second one out")
def test_the_second_process_is_turned_away(tmp_path):
    path = tmp_path / "job.json"
    path.write_text("{}")
    first = subprocess.Popen(
        [sys.executable, "-c", HOLD, str(path)], stdout=subprocess.PIPE, cwd=Path(__file__).parents[2]
    )
    assert first.stdout is not None and first.stdout.readline() == b"held\n"
    with pytest.raises(JobError, match="another process replays this bundle"), one_at_a_time(path):
        pass
    first.send_signal(signal.SIGKILL)
    first.wait()
    first.stdout.close()
    with one_at_a_time(path):
        assert path.read_text() == "{}"
