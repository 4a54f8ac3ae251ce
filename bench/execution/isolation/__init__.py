"""One protocol for confined work: a job runs in a process of its own, under limits, and reports results at once.

messages  what a job says, and what it is told
channel         a job, and how it speaks to whoever runs it
worker          the process of a job
worker_process  the same process, seen by its parent
run             stream(job, limits): its messages; here(job, take): the same in this process
process         a process group that is watched, and killed at a limit
limits, inside  what a process may take, and how it submits to that
signals, stack  interrupts, and where a process was when it ended
"""
