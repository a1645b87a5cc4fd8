"""In: chromedriver and chromium on this machine. Out: a browser that is used as a person uses one: clicks, keys, shown
text, screenshots, console. It speaks the WebDriver protocol over plain HTTP with Python's standard library only.
Frame and unit: CSS pixels, seconds."""

import base64
import io
import json
import re
import shutil
import subprocess
import threading
import urllib.error
import urllib.request

import waits
from waits import PATIENCE

ELEMENT = "element-6066-11e4-a52e-4f735466cecf"
STANDS = """
  const css = arguments[0], now = () => { const r = document.querySelector(css).getBoundingClientRect(); return [r.left, r.top, r.width, r.height]; };
  return new Promise((stands) => {
    let before = now();
    const look = () => { const r = now(); if (r.every((v, k) => v === before[k])) return stands(r); before = r; requestAnimationFrame(look); };
    requestAnimationFrame(look);
  });"""


class Browser:
    """A chromium with a page of 1280x800 CSS px; `clicks` counts the presses that an operator would have made."""

    @staticmethod
    def there():
        return shutil.which("chromedriver") and (shutil.which("chromium") or shutil.which("google-chrome"))

    def __init__(self, folder, width=1280, height=800, flags=()):
        # chromedriver chooses a free port and prints its number. It ends if another program takes the port meanwhile.
        for _ in range(3):
            self.driver = subprocess.Popen(["chromedriver", "--port=0"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
            port = next((m[1] for m in map(re.compile(r"success.* port (\d+)").search, self.driver.stdout) if m), None)
            if port:
                break
            self.driver.wait()
        assert port, "chromedriver does not say its port"
        self.root = f"http://127.0.0.1:{port}"
        threading.Thread(target=self.driver.stdout.read, daemon=True).start()
        self.clicks, self.session = 0, ""
        arguments = [
            "--headless=new", "--no-sandbox", "--disable-dev-shm-usage", f"--window-size={width},{height}", "--hide-scrollbars",
            f"--user-data-dir={folder}", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--lang=en",
            "--force-device-scale-factor=1", "--force-prefers-reduced-motion", *flags,
        ]
        wanted = {"alwaysMatch": {"browserName": "chrome", "goog:loggingPrefs": {"browser": "ALL"}, "goog:chromeOptions": {"args": arguments}}}
        self.session = "/session/" + self.ask("POST", "/session", {"capabilities": wanted})["sessionId"]
        # Enlarges the window by its frame, so that the page has the wanted size.
        inner = self.run("return [innerWidth, innerHeight]")
        self.ask("POST", "/window/rect", {"width": 2 * width - inner[0], "height": 2 * height - inner[1]})

    def ask(self, method, path, body=None):
        data = None if method == "GET" else json.dumps(body or {}).encode()
        request = urllib.request.Request(self.root + self.session + path, data, {"Content-Type": "application/json"}, method=method)
        try:
            with urllib.request.urlopen(request, timeout=2 * PATIENCE) as answer:
                return json.load(answer)["value"]
        except urllib.error.HTTPError as e:
            raise AssertionError(f"{method} {path}: {json.load(e)['value']['message']}") from None

    def open(self, url):
        self.ask("POST", "/url", {"url": url})

    def run(self, script, *args):
        return self.ask("POST", "/execute/sync", {"script": script, "args": list(args)})

    def until(self, what, script, *args, seconds=PATIENCE):
        """Waits until a script returns something true, and returns that."""
        try:
            return waits.until(what, lambda: self.run(script, *args), seconds)
        except AssertionError as e:
            raise AssertionError(f"{e}; the page says: {self.run('return document.body.innerText')[:1500]}") from None

    def pressable(self, css):
        return self.until(f"{css} can be pressed", "const e = document.querySelector(arguments[0]); return e && !e.disabled && !e.closest('[hidden]') && e", css)[ELEMENT]

    def click(self, css):
        def pressed():
            button = self.pressable(css)
            try:
                self.place(css)
                self.ask("POST", f"/element/{button}/click")
                return True
            except AssertionError as e:
                # The page was redrawn between the search for the element and the press: nothing was pressed.
                if not any(why in str(e) for why in ("stale element", "click intercepted", "reading 'getBoundingClientRect'")):
                    raise

        waits.until(f"{css} stands to be pressed", pressed)
        self.clicks += 1

    def page(self, name):
        """Presses a page's name at the left and waits until the page is shown."""
        self.click(f"#nav a[href='#/{name}']")
        self.ready(name)

    def ready(self, name):
        # The server's first message fills the bar, and the pages are drawn from it.
        self.until(f"page {name}", "return document.getElementById('main').dataset.ready === arguments[0] && document.querySelector('#bar .badge')?.textContent", name)

    def reload(self, name):
        self.ask("POST", "/refresh")
        self.ready(name)

    def place(self, css):
        """Left, top, width and height of an element, once they are equal in two successive frames of the page."""
        return self.run(STANDS, css)

    def drag(self, css, a, b, hold=0.0):
        """Presses at a, moves to b, releases; a and b in fractions of the element's width and height."""
        r = self.place(css)
        at = lambda p: {"x": round(r[0] + p[0] * r[2]), "y": round(r[1] + p[1] * r[3])}
        steps = [
            {"type": "pointerMove", "duration": 0, **at(a)}, {"type": "pointerDown", "button": 0},
            *([{"type": "pause", "duration": int(1000 * hold)}] if hold else []),
            {"type": "pointerMove", "duration": 60, **at(((a[0] + b[0]) / 2, (a[1] + b[1]) / 2))},
            {"type": "pointerMove", "duration": 60, **at(b)}, {"type": "pointerUp", "button": 0},
        ]
        self.ask("POST", "/actions", {"actions": [{"type": "pointer", "id": "mouse", "parameters": {"pointerType": "mouse"}, "actions": steps}]})
        self.clicks += 1

    def hold(self, css):
        """Presses the mouse button and holds it until `let_go`."""
        self.pressable(css)
        self.run("document.querySelector(arguments[0]).scrollIntoView({ block: 'center' })", css)
        left, top, width, height = self.place(css)
        self.mouse({"type": "pointerMove", "duration": 0, "x": round(left + width / 2), "y": round(top + height / 2)}, {"type": "pointerDown", "button": 0})
        self.clicks += 1

    def let_go(self):
        self.mouse({"type": "pointerUp", "button": 0})

    def mouse(self, *steps):
        self.ask("POST", "/actions", {"actions": [{"type": "pointer", "id": "mouse", "parameters": {"pointerType": "mouse"}, "actions": list(steps)}]})

    def keys(self, *keys):
        steps = [x for k in keys for x in ({"type": "keyDown", "value": k}, {"type": "keyUp", "value": k})]
        self.ask("POST", "/actions", {"actions": [{"type": "key", "id": "keys", "actions": steps}]})

    def text(self, css="body"):
        return self.run("return document.querySelector(arguments[0])?.innerText ?? ''", css)

    def picture(self):
        return base64.b64decode(self.ask("GET", "/screenshot"))

    def console(self):
        """Messages in the console since the last call."""
        return [f"{e['level']}: {e['message']}" for e in self.ask("POST", "/se/log", {"type": "browser"}) if e["level"] in ("SEVERE", "WARNING")]

    def close(self):
        try:
            self.ask("DELETE", "")
        finally:
            self.driver.terminate()
            self.driver.wait(PATIENCE)


def levels(png):
    """A PNG with a palette of 256 colours, so that its file is small. Only who draws the documents' pictures needs
    Pillow."""
    from PIL import Image

    out = io.BytesIO()
    picture = Image.open(io.BytesIO(png)).convert("RGB").quantize(256, method=Image.Quantize.MEDIANCUT)
    picture.save(out, "PNG", optimize=True)
    return out.getvalue()


def unfilter(kind, row, before, n):
    if kind == 0:
        return row
    if kind == 2:
        return bytearray((a + b) & 255 for a, b in zip(row, before))
    for i in range(len(row)):
        a, b, c = (row[i - n] if i >= n else 0), before[i], (before[i - n] if i >= n else 0)
        if kind == 1:
            p = a
        elif kind == 3:
            p = (a + b) // 2
        else:
            q = a + b - c
            pa, pb, pc = abs(q - a), abs(q - b), abs(q - c)
            p = a if pa <= pb and pa <= pc else b if pb <= pc else c
        row[i] = (row[i] + p) & 255
    return row
