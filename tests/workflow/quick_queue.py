"""The command, with a Slurm that is asked every second: ``python -P quick_queue.py run ...``.

Its plugin waits ten seconds longer each time that it finds no job ended, and for that wait at the
end. No test is about this.
"""

import asyncio

from snakemake_interface_executor_plugins.executors.remote import RemoteExecutor

from sandmould.cli.commands import app


async def _sleep(self: RemoteExecutor) -> None:
    await asyncio.sleep(1.0)


RemoteExecutor.sleep = _sleep
app()
