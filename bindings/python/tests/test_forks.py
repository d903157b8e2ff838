"""A fork while another thread is in its first call."""

import os
import subprocess
import sys

import pytest

# The threads of the pool that the child wants are there before. Those of the thread's own pool, 256, take some ten milliseconds to start.
FORK_IN_A_FIRST_CALL = """
import os, threading, numpy as np, sdftool
field, points = sdftool.sphere(1.0), np.zeros((2000, 3))
field(points)
begins = threading.Event()
def first_call():
    begins.set()
    field(points, threads=256)
thread = threading.Thread(target=first_call)
thread.start()
begins.wait()
child = os.fork()
if child == 0:
    os._exit(7 if (field(points) == -1.0).all() else 1)
thread.join()
for _ in range(3000):
    done, status = os.waitpid(child, os.WNOHANG)
    if done:
        break
    threading.Event().wait(0.01)
else:
    os.kill(child, 9)
    status = os.waitpid(child, 0)[1]
print(os.waitstatus_to_exitcode(status))
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="fork")
def test_a_process_forked_during_the_first_call_of_another_thread_answers():
    # It hung in each of three runs where a pool was started without the interpreter's lock.
    said = subprocess.run([sys.executable, "-c", FORK_IN_A_FIRST_CALL], capture_output=True, text=True, timeout=120)
    assert said.stdout == "7\n", said.stderr


def test_a_process_keeps_the_threads_of_a_few_counts_alone():
    code = """
import os, time, numpy as np, sdftool
ball, points = sdftool.sphere(1.0), np.zeros((10, 3))
for threads in range(2, 40):
    assert (ball.sample(points, threads=threads)[0] == -1.0).all()
# Threads of a pool that is gone end in their own time.
deadline = time.monotonic() + 30
count = lambda: len(os.listdir("/proc/self/task"))
while count() >= 4 * 39 + 40 and time.monotonic() < deadline:
    time.sleep(0.1)
print(count())
"""
    counted = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    # Four pools of at most 39 threads, and those that numpy has.
    assert int(counted.stdout) < 4 * 39 + 40
