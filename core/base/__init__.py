"""What everything else stands on: array types, vectors, errors, files, threads, time. Nothing here imports ours."""
