"""One protocol for confined work: a job runs in its own process, under limits, and sends results as it finds them.

messages        types of messages from a job, and of orders to it
channel         a job, and its connection to the process that runs it
worker          the process of a job
worker_process  the same process, as its parent sees it
run             stream(job, limits): its messages; here(job, take): the same in this process
process         a process group that is watched, and killed at a limit
descendants     all that it has started
limits, inside  limits, and those that a process sets on itself
signals, stack  interrupts, and the stack of a process that was ended
"""
