# make station  build, serve the operator's screen on a simulated station in ./demo-cell
# make demo   build, simulate a station, scan it, leave ./demo/index.html
# make test   everything, on software Vulkan where it can be had
# make gentl  the GenTL producer, by which GenICam programs see a 3-D camera: target/release/sheetlight.cti
# make opcua  the OPC UA server beside a station: target/release/sheetlight-opcua
# make ros2   live messages and a station's services for ROS 2: target/release/sheetlight-ros2
# make bench  figures of this machine;  make bench-peers  side by side with OpenCV and numba

CARGO ?= cargo
VENV := .venv
# What is built and tested together: library, program, and what uses the library.
PARTS := --package sheetlight --package sheetlight-program --package shader-twin --package sheetlight-gentl
# Where cargo puts what it builds: a person may have set another folder.
TARGET := $(or $(CARGO_TARGET_DIR),target)
export XDG_RUNTIME_DIR ?= $(shell mktemp -d /tmp/sheetlight-run.XXXXXX)

.PHONY: station browser demo pages book lint test gentl opcua ros2 bench bench-entries bench-peers vulkan python \
	notebooks pictures cameras build clean

demo: vulkan build
	$(TARGET)/release/sheetlight demo --out demo

# Prints the address to open in a browser; Ctrl-C ends it.
station: vulkan build
	$(TARGET)/release/sheetlight station serve --simulate --station demo-cell

build:
	$(CARGO) build --release --locked

# All parts at once: so the library has the same features for all of them, and is compiled once. OPC UA and ROS 2
# have nothing of the library; their tests run the program that was built before.
test: vulkan python cameras browser lint
	PATH="$(CURDIR)/$(VENV)/bin:$$PATH" $(if $(SHEETLIGHT_REQUIRE_GPU),,SHADER_TWIN_ALLOW_SKIP=1) \
		$(CARGO) test --locked $(PARTS) -- --show-output
	PATH="$(CURDIR)/$(VENV)/bin:$$PATH" $(CARGO) test --locked --package sheetlight-opcua \
		--package sheetlight-registers -- --show-output
	PATH="$(CURDIR)/$(VENV)/bin:$$PATH" $(CARGO) test --locked --package sheetlight-ros2 -- --show-output

# A toolchain without clippy says so and goes on.
# The pages of the screen: format and types.
pages:
	tools/pages.sh

# The documents as a book with search: target/book/index.html.
book:
	CARGO="$(CARGO)" tools/book.sh

lint: pages book
	if $(CARGO) clippy --version >/dev/null 2>&1; then \
		$(CARGO) clippy --locked $(PARTS) --all-targets \
			-- -D warnings && \
		$(CARGO) clippy --locked --package sheetlight-opcua --package sheetlight-registers --all-targets \
			-- -D warnings && \
		$(CARGO) clippy --locked --package sheetlight-ros2 --all-targets -- -D warnings; \
	else echo "clippy is not installed: skipped"; fi
	$(CARGO) check --locked --package outside
	if $(CARGO) clippy --version >/dev/null 2>&1; then \
		$(CARGO) clippy --locked --package sheetlight-python --features whole -- -D warnings; fi
	RUSTDOCFLAGS="-D warnings" $(CARGO) doc --locked --no-deps --package sheetlight --package sheetlight-program \
		--package shader-twin

# The GenTL producer, under the name by which GenICam programs look for it.
gentl:
	$(CARGO) build --release --locked --package sheetlight-gentl
	cp -f $(TARGET)/release/libsheetlight_gentl.so $(TARGET)/release/sheetlight.cti

# The OPC UA server beside a station.
opcua:
	$(CARGO) build --release --locked --package sheetlight-opcua

# Live messages to ROS 2.
ros2:
	$(CARGO) build --release --locked --package sheetlight-ros2

bench: vulkan build
	$(TARGET)/release/sheetlight bench

# Sheetlight, OpenCV, Steger and a compiled centroid on the same pictures, in turns.
SIZE = 640x480
bench-entries: vulkan build
	tools/python-env.sh $(VENV) peers
	PATH="$(TARGET)/release:$(VENV)/bin:$$PATH" sheetlight bench run --out throughput.json --size $(SIZE) \
		--entry 'cpu=sheetlight bench entry --on cpu' --entry 'gpu=sheetlight bench entry --on gpu' \
		--entry 'pipe=sheetlight bench entry --nothing' --entry 'centroid=python benches/entries/centroid.py' \
		--entry 'opencv-tiles=python benches/entries/opencv.py --tiles' --entry 'opencv=python benches/entries/opencv.py' \
		--entry 'steger=python benches/entries/steger.py'

bench-peers: vulkan build
	tools/python-env.sh $(VENV) peers
	$(VENV)/bin/python benches/peers/run.py --sheetlight $(TARGET)/release/sheetlight
	$(VENV)/bin/python benches/peers/find.py --cargo $(CARGO)
	$(CARGO) bench --locked --bench calibration
	$(VENV)/bin/python benches/peers/calibration.py

# Software Vulkan (Mesa lavapipe) is installed where we may; without it the CPU twins do the work.
vulkan:
	tools/vulkan.sh

# The screen's pages are tested in a real browser.
browser:
	tools/browser.sh

# What the tests talk to: ffmpeg, aravis' fake camera, an MQTT broker.
cameras:
	tools/cameras.sh

# The scorer of the reference data and the comparisons need numpy, scipy and libigl. The Python package needs maturin,
# mypy and pytest; its files and notebooks need what other programs read and show them with. Sparkplug's reader stands
# in an environment inside this one.
python:
	tools/python-env.sh $(VENV) test
	tools/python-env.sh $(VENV) files
	tools/python-env.sh $(VENV) genicam
	tools/python-env.sh $(VENV)/sparkplug sparkplug

# The figures of docs/python.md: the last one of each notebook, with this Python package, installed aside.
SITE := $(abspath $(TARGET))/site
notebooks: python
	$(VENV)/bin/python -m pip install -q --no-deps --upgrade --target $(SITE) ./python
	PYTHONPATH=$(SITE) $(VENV)/bin/python python/notebooks/run.py --pictures docs/images

# All pictures of the documents, from the program as it is: the screen's, the notebooks', the guides'.
pictures: vulkan python browser build notebooks
	PATH="$(CURDIR)/$(VENV)/bin:$$PATH" SHEETLIGHT_WRITE=1 $(CARGO) test --locked --test web
	$(VENV)/bin/python tools/pictures.py $(TARGET)/release/sheetlight

clean:
	$(CARGO) clean
	rm -rf demo demo-cell $(VENV)
