"""A headless Chromium, spoken to by its own protocol."""

import asyncio
import json
import shutil
import subprocess
import time
import urllib.request
from pathlib import Path

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
# Bokeh draws within shadow roots, which document.querySelector does not enter.
DEEP = """
(() => {
  const found = [];
  const walk = root => {
    for (const item of root.querySelectorAll('*')) { found.push(item); if (item.shadowRoot) walk(item.shadowRoot); }
  };
  walk(document);
  return found;
})()
"""


class Browser:
    """A page in Chromium; `folder` is for what the browser keeps."""

    def __init__(self, address: str, folder: Path, patience: float = 60.0) -> None:
        self.patience, self.number = patience, 0
        words = [
            "--headless=new",
            "--no-sandbox",
            "--disable-gpu",
            "--remote-debugging-port=0",
            "--window-size=1500,1100",
        ]
        self.process = subprocess.Popen(
            [CHROMIUM, *words, f"--user-data-dir={folder}", address],
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        self.loop = asyncio.new_event_loop()
        try:
            port = self.wait(lambda: (folder / "DevToolsActivePort").read_text().splitlines()[0])
            self.socket = self.loop.run_until_complete(self._connect(port))
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> "Browser":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        self.process.terminate()
        self.process.wait()
        self.loop.close()

    async def _connect(self, port: str):
        from tornado.websocket import websocket_connect

        def page() -> str:
            with urllib.request.urlopen(f"http://127.0.0.1:{port}/json/list") as answer:
                return next(item["webSocketDebuggerUrl"] for item in json.load(answer) if item["type"] == "page")

        return await websocket_connect(self.wait(page), max_message_size=1 << 28)

    def wait(self, look):
        """Return what `look` returns once it is true; what goes wrong until then does not count."""
        end = time.monotonic() + self.patience
        while True:
            try:
                found = look()
                if found:
                    return found
            except (OSError, IndexError, StopIteration):
                found = None
            assert time.monotonic() < end, "the page does not show what it should"
            time.sleep(0.1)

    def call(self, method: str, **parameters: object) -> dict:
        """Call a method of the protocol; return its result."""
        return self.loop.run_until_complete(self._call(method, parameters))

    async def _call(self, method: str, parameters: dict) -> dict:
        self.number += 1
        await self.socket.write_message(json.dumps({"id": self.number, "method": method, "params": parameters}))
        while True:
            answer = json.loads(await self.socket.read_message())
            if answer.get("id") == self.number:
                assert "error" not in answer, answer
                return answer["result"]

    def evaluate(self, code: str):
        """Return the value of an expression of JavaScript."""
        result = self.call("Runtime.evaluate", expression=code, returnByValue=True)
        assert "exceptionDetails" not in result, result
        return result["result"].get("value")

    def text(self) -> str:
        """Return what stands in the texts of the page."""
        return self.evaluate(f"{DEEP}.filter(e => e.matches('.bk-clearfix')).map(e => e.innerText).join('\\n')")

    def plots(self) -> list[list[float]]:
        """Return the places of the plots: left, top, width, height."""
        code = f"{DEEP}.filter(e => e.matches('.bk-events')).map(e => e.getBoundingClientRect())"
        return self.evaluate(f"{code}.map(r => [r.left, r.top, r.width, r.height])")

    def click(self, x: float, y: float) -> None:
        """Click at a place."""
        for kind, buttons in (("mousePressed", 1), ("mouseReleased", 0)):
            self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=buttons, clickCount=1)
