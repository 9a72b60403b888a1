"""Ask whether a Dask scheduler answers at an address, before a client of distributed waits for it."""

from __future__ import annotations

import re
import socket


def refuse_no_scheduler(address: str, timeout_s: float) -> None:
    """Raise an error if no Dask scheduler answers at an address; this takes `timeout_s` at most.

    A scheduler speaks first when somebody connects by TCP. Its dashboard waits for a request, and a client of
    distributed would wait for it for minutes.

    Parameters
    ----------
    address : str
        Such as ``"tcp://host:8786"``.
    timeout_s : float
        [s]

    Raises
    ------
    ValueError
        If it is no address.
    ConnectionError
        If nobody listens there, or whoever listens is no scheduler.
    """
    form = re.fullmatch(r"(?:(?P<kind>\w+)://)?(?P<host>[^/:\s]+|\[[0-9a-fA-F:.]+\]):(?P<port>\d{1,5})/?", address)
    if not form or int(form["port"]) > 65535:
        raise ValueError(f"cluster={address!r} is no address; write tcp://HOST:PORT, for example tcp://127.0.0.1:8786")
    if (form["kind"] or "tcp") != "tcp":
        return
    try:
        with socket.create_connection((form["host"].strip("[]"), int(form["port"])), timeout_s) as probe:
            if not probe.recv(1):
                raise ConnectionError(_no_scheduler(address))
    except TimeoutError:
        raise ConnectionError(_no_scheduler(address)) from None
    except ConnectionResetError:
        raise ConnectionError(_no_scheduler(address)) from None
    except ConnectionRefusedError:
        raise ConnectionError(no_cluster(address)) from None
    except socket.gaierror as error:
        raise ConnectionError(f"{no_cluster(address)} ({form['host']}: {error.strerror})") from None


def no_cluster(address: str) -> str:
    """Return the line that says that nobody listens."""
    return f"no cluster answers at {address}; start one with: dask scheduler, and dask worker {address}"


def _no_scheduler(address: str) -> str:
    """Return the line that says that somebody listens who is no scheduler."""
    return (
        f"no Dask scheduler answers at {address}: something else listens there, such as its dashboard (8787); give the "
        "address that dask scheduler prints, by default tcp://HOST:8786"
    )
