//! In: a GigE Vision camera. Out: its pictures, reports of incomplete ones; its features; its clock.
//! Frame and unit: the camera's clock in ns.

use super::coordinates::{Coordinates, Told, is_coordinates};
use super::delivery::{Delivery, Got, sends_parts};
use super::features::{feature, own_name, restore, settings, several};
use super::find::find;
use super::numbers::Numbers;
use super::pixels::{depth, unpack};
use crate::camera::Readout;
use crate::capture::clock::{RoundTrip, now_ns};
use crate::capture::feature::{Feature, Range, Value};
use crate::capture::format::Format;
use crate::capture::picture::{Event, Picture, PictureSource};
use crate::fault::{Fault, Result};
use crate::raster::Image;
use crate::recording::profiles::measured;
use std::time::{Duration, Instant};
use viva_genicam::gige::DeviceInfo;
use viva_genicam::{Camera, ControlState, GenicamError, GigeRegisterIo, StreamOptions, blocking};

/// After this time without data the camera is queried whether it is still there.
const SILENCE: Duration = Duration::from_secs(1);
/// Packet size that fits every network without special setup, bytes.
const USUAL_PACKET: u32 = 1500;
const LATCH: [&str; 3] = ["GevTimestampControlLatch", "TimestampControlLatch", "TimestampLatch"];
const CLOCK: [&str; 3] = ["GevTimestampValue", "TimestampValue", "TimestampLatchValue"];
const TICKS: [&str; 2] = ["GevTimestampTickFrequency", "TimestampTickFrequency"];
const EXPOSURE: [&str; 2] = ["ExposureTime", "ExposureTimeAbs"];
const CHUNKS: [&str; 4] = ["ChunkCounterValue", "ChunkEncoderValue", "ChunkLineStatusAll", "ChunkEncoderStatusValue"];

/// A camera on the network.
pub struct GigeCamera {
    word: String,
    /// Its serial number, or its address if it has none.
    serial: String,
    packet: Option<u32>,
    camera: Camera<GigeRegisterIo>,
    stream: Option<Delivery>,
    format: Format,
    readout: Option<Readout>,
    pixel_format: String,
    /// What it states about the coordinates that it sends, or why they cannot be used; none if it sends light.
    coordinates: Option<Result<Coordinates>>,
    exposure_ns: Option<u64>,
    /// Whether software triggers each picture (TriggerMode On, TriggerSource Software).
    on_command: bool,
    /// ns per tick of its clock.
    tick_ns: f64,
    latch: Option<(&'static str, &'static str)>,
    chunk: Option<&'static str>,
    resent: u64,
    heard: Instant,
    /// Whether it was seen to send something that is no picture.
    foreign: bool,
    /// Whether it sends payloads of several parts.
    parts: bool,
    numbers: Numbers,
    /// Its settings when it began to send. A camera that lost its power comes back without them.
    kept: Vec<(&'static str, String)>,
}

fn said(what: &str, e: &GenicamError) -> Fault {
    let text = e.to_string();
    // Some cameras answer a second program that asks for control with an error, others do not answer.
    let denied = text.to_uppercase().contains("ACCESS_DENIED") || text.contains("claim control");
    let what = format!("{what}: {text}");
    if denied {
        return Fault::input(what)
            .cause("the camera is in use: another program has control of it")
            .next("end the other program (a viewer, another sheetlight), or wait until its heartbeat runs out");
    }
    Fault::input(what)
        .cause("the network, or a camera that differs from the standard")
        .next("check it with: sheetlight camera show")
}

fn serial(device: &DeviceInfo) -> String {
    device.serial.clone().filter(|s| !s.is_empty()).unwrap_or_else(|| device.ip.to_string())
}

impl GigeCamera {
    /// Takes control of the camera; it sends nothing yet. `packet` is the packet size in bytes; none: as large as
    /// the network carries.
    ///
    /// # Errors
    /// No such camera, a camera that is in use, or one whose pixels are not grey.
    pub fn open(word: &str, packet: Option<u32>) -> Result<GigeCamera> {
        let device = find(word)?;
        let camera = blocking::connect(&device).map_err(|e| said(&format!("gige://{word}"), &e))?;
        // Packets as large as a loopback interface allows never arrive complete.
        let packet = packet.or(device.ip.is_loopback().then_some(USUAL_PACKET));
        let mut camera = GigeCamera {
            word: word.into(),
            serial: serial(&device),
            packet,
            camera,
            stream: None,
            format: Format { width: 1, height: 1, bits: 8 },
            readout: None,
            pixel_format: String::new(),
            coordinates: None,
            exposure_ns: None,
            on_command: false,
            tick_ns: 1.0,
            latch: None,
            chunk: None,
            resent: 0,
            heard: Instant::now(),
            foreign: false,
            parts: false,
            numbers: Numbers::default(),
            kept: Vec::new(),
        };
        camera.look()?;
        Ok(camera)
    }

    /// With the component chosen that is read: settings mean the chosen one. The user's choice is restored.
    fn on_component<T>(&mut self, work: impl FnOnce(&mut Self) -> T) -> T {
        let own = self.camera.get_enum("ComponentSelector").ok();
        self.parts = several(&mut self.camera) && sends_parts(&self.camera);
        let out = work(self);
        if let Some(own) = own {
            let _ = self.camera.set("ComponentSelector", &own);
        }
        out
    }

    /// Reads the format of its pictures.
    fn look(&mut self) -> Result<()> {
        self.on_component(Self::read_format)
    }

    fn read_format(&mut self) -> Result<()> {
        let at = format!("gige://{}", self.word);
        let read = |name: &str| self.camera.get_integer(name).map_err(|e| said(&format!("{at}: {name}"), &e));
        let size = |v: i64| u32::try_from(v).ok().filter(|v| (1..=65_535).contains(v));
        let (width, height) = (read("Width")?, read("Height")?);
        let (Some(width), Some(height)) = (size(width), size(height)) else {
            return Err(Fault::input(format!("{at}: says its pictures are {width}x{height}")).next("reset the camera"));
        };
        self.pixel_format = self.camera.get_enum("PixelFormat").map_err(|e| said(&format!("{at}: PixelFormat"), &e))?;
        let format = self.pixel_format.clone();
        self.coordinates = is_coordinates(&format).then(|| Coordinates::told(self, &format).map_err(|e| e.at(&at)));
        // Of coordinates the picture shows only where something was measured.
        let bits = if self.coordinates.is_some() { 8 } else { depth(&format).map_err(|e| e.at(&at))? };
        self.format = Format { width, height, bits };
        self.readout = super::readout::of(&self.camera);
        let exposure = EXPOSURE.iter().find_map(|name| self.camera.get_float(name).ok());
        self.exposure_ns = exposure.filter(|us| (0.0..1e9).contains(us)).map(|us| (1e3 * us) as u64);
        let says = |name: &str, word: &str| self.camera.get_enum(name).is_ok_and(|is| is == word);
        self.on_command = says("TriggerMode", "On") && says("TriggerSource", "Software");
        let ticks = TICKS.iter().find_map(|name| self.camera.get_integer(name).ok()).filter(|hz| *hz > 0);
        self.tick_ns = ticks.map_or(1.0, |hz| 1e9 / hz as f64);
        let has = |name: &&&str| self.camera.nodemap().node(name).is_some();
        let pair = (LATCH.iter().find(has), CLOCK.iter().find(has));
        self.latch = if let (Some(latch), Some(clock)) = pair { Some((latch, clock)) } else { None };
        self.chunk = CHUNKS.iter().find(has).copied();
        Ok(())
    }

    /// Makes the camera send.
    fn start(&mut self) -> Result<()> {
        let at = format!("gige://{}", self.word);
        if self.kept.is_empty() {
            self.kept = self.on_component(|camera| settings(&mut camera.camera));
        }
        let options = StreamOptions::new();
        let options = match self.packet {
            Some(size) => options.packet_size(size),
            None => options.auto_packet_size(),
        };
        let part = self.parts.then_some(&*self.pixel_format);
        let stream = Delivery::open(&mut self.camera, options, part).map_err(|e| said(&at, &e))?;
        self.camera.acquisition_start().map_err(|e| said(&at, &e))?;
        self.stream = Some(stream);
        self.numbers = Numbers::default();
        self.heard = Instant::now();
        Ok(())
    }

    fn ns(&self, ticks: u64) -> u64 {
        if self.tick_ns == 1.0 { ticks } else { (ticks as f64 * self.tick_ns) as u64 }
    }

    /// The encoder's or a counter's value that came with the picture.
    fn chunk_count(&mut self, frame: &viva_genicam::Frame) -> Option<i64> {
        let name = self.chunk?;
        frame.chunks.as_ref()?;
        self.camera.with_chunks(frame, |camera| camera.get_integer(name).ok())
    }

    fn taken(&mut self, frame: viva_genicam::Frame) -> Event {
        let host_ns = now_ns();
        self.heard = Instant::now();
        let Some(id) = self.numbers.on_from(frame.block_id) else {
            return self.gone(&format!("its count began again, at {}: it was reset", frame.block_id));
        };
        if !frame.is_complete() {
            return Event::Incomplete { id, why: format!("{:?}", frame.status) };
        }
        let count = self.chunk_count(&frame);
        let device_ns = frame.ts_dev.map(|t| self.ns(t));
        let format = frame.pixel_format.name().unwrap_or(&self.pixel_format).to_owned();
        if self.coordinates.is_some() {
            return self.measured(frame, id, device_ns, host_ns, count);
        }
        let viva_genicam::Frame { payload, raw_payload, width, height, padding_x, .. } = frame;
        // The two share the bytes: dropping one lets the other be converted without a copy.
        drop(raw_payload);
        let image = unpack(&format, width, height, usize::from(padding_x), payload.into());
        match image {
            Ok(image) if Format::of(&image) == self.format => {
                let exposure_ns = self.exposure_ns;
                let (stand, profiles) = (None, None);
                let picture = Picture { image, id, device_ns, host_ns, exposure_ns, count, stand, profiles };
                Event::Picture(Box::new(picture))
            }
            Ok(image) => {
                Event::Incomplete { id, why: format!("is {}, the camera said {}", Format::of(&image), self.format) }
            }
            Err(fault) => Event::Incomplete { id, why: fault.what },
        }
    }

    /// A picture of coordinates.
    fn measured(
        &self,
        frame: viva_genicam::Frame,
        id: u64,
        device_ns: Option<u64>,
        host_ns: u64,
        count: Option<i64>,
    ) -> Event {
        let told = match self.coordinates.as_ref().expect("asked by the caller") {
            Ok(told) => told,
            Err(fault) => return Event::Lost(fault.clone()),
        };
        let size = [frame.width, frame.height];
        let named = frame.pixel_format.name().is_none_or(|is| is == told.pixel_format);
        if !named || size != [self.format.width, self.format.height] {
            let (now, [w, h]) = (frame.pixel_format, size);
            return Event::Incomplete { id, why: format!("is {w}x{h} in {now}, the camera said {}", self.format) };
        }
        match told.profiles(frame.width, frame.height, usize::from(frame.padding_x), &frame.payload) {
            Ok(profiles) => {
                let lit = |p: &[f64; 2]| if measured(p) { u8::MAX } else { 0 };
                let image = Image::from_u8(frame.width, frame.height, profiles.iter().flatten().map(lit).collect());
                let (exposure_ns, stand, profiles) = (self.exposure_ns, None, Some(profiles));
                let picture = Picture { image, id, device_ns, host_ns, exposure_ns, count, stand, profiles };
                Event::Picture(Box::new(picture))
            }
            Err(fault) => Event::Incomplete { id, why: fault.what },
        }
    }

    fn gone(&self, what: &str) -> Event {
        Event::Lost(
            Fault::input(format!("gige://{}: {what}", self.word))
                .cause("its cable or power is out, or another program took it")
                .next("plug it in; a running command continues automatically"),
        )
    }
}

impl PictureSource for GigeCamera {
    fn format(&self) -> Format {
        self.format
    }

    fn readout(&self) -> Option<Readout> {
        self.readout
    }

    fn next(&mut self, within: Duration) -> Event {
        self.receive(within)
    }

    fn trigger(&mut self) -> Result<bool> {
        if !self.on_command {
            return Ok(false);
        }
        if self.stream.is_none() {
            self.start()?;
        }
        let told = self.camera.execute_command("TriggerSoftware");
        told.map_err(|e| said(&format!("gige://{}: TriggerSoftware", self.word), &e))?;
        Ok(true)
    }

    fn resent(&self) -> u64 {
        self.resent
    }

    fn clock(&mut self) -> Result<Option<RoundTrip>> {
        let Some((latch, value)) = self.latch else { return Ok(None) };
        let at = |e: GenicamError| said("the camera's clock", &e);
        let before_ns = now_ns();
        self.camera.execute_command(latch).map_err(at)?;
        let after_ns = now_ns();
        self.camera.invalidate(value);
        let ticks = self.camera.get_integer(value).map_err(at)?;
        Ok(Some(RoundTrip { before_ns, there_ns: self.ns(ticks.max(0) as u64), after_ns }))
    }

    fn reopens(&self) -> bool {
        !self.foreign
    }

    fn coordinates(&self) -> Result<Option<String>> {
        match &self.coordinates {
            Some(told) => told.clone().map(|told| Some(serde_json::to_string(&told).expect("plain data"))),
            None => Ok(None),
        }
    }

    fn reopen(&mut self) -> Result<()> {
        self.stream = None;
        let (at, device) = (format!("gige://{}", self.word), find(&self.word)?);
        self.camera = blocking::connect(&device).map_err(|e| said(&at, &e))?;
        let (former, coordinates) = ((self.format, self.readout), self.coordinates.clone());
        self.on_component(|camera| restore(&mut camera.camera, &camera.kept))
            .map_err(|(name, e)| said(&format!("{at}: {name}"), &e))?;
        self.look()?;
        if self.format != former.0 {
            return Err(
                Fault::input(format!("the camera is {} now, was {}", self.format, former.0)).next("start again")
            );
        }
        if self.coordinates != coordinates {
            let what = "the camera states other coordinates than before it was lost";
            return Err(Fault::input(what).next("start again"));
        }
        if self.readout != former.1 {
            let words = |r: Option<Readout>| r.map_or("not known".into(), |r| r.to_string());
            let (now, was) = (words(self.readout), words(former.1));
            return Err(Fault::input(format!("the camera's readout is {now}; it was {was}")).next("start again"));
        }
        self.start()
    }

    fn features(&mut self) -> Result<Vec<Feature>> {
        // Features in a category are meant for users; the others are internals of the camera's description file.
        let listed = self.camera.nodemap().categories().into_iter().flat_map(|(_, names)| names.to_vec());
        let mut names: Vec<String> = listed.collect();
        names.sort();
        names.dedup();
        let all: Vec<Feature> = names.iter().filter_map(|name| feature(&mut self.camera, name)).collect();
        Ok(all)
    }

    fn set(&mut self, name: &str, value: &str) -> Result<()> {
        let name = own_name(&self.camera, name);
        let Some(feature) = feature(&mut self.camera, name) else {
            return Err(Fault::usage(format!("gige://{}: has no feature {name}", self.word))
                .cause("a misspelt name, or a camera without it")
                .next("list its features with: sheetlight camera show"));
        };
        let refuse = |why: String| {
            Err(Fault::usage(format!("{name} cannot be set to {value}: {why}"))
                .cause("the camera's limits, which may follow from other settings")
                .next("see values, units and ranges: sheetlight camera show"))
        };
        match (&feature.range, value.parse::<f64>()) {
            (Range::Between(low, high), Ok(v)) if !(*low..=*high).contains(&v) => {
                return refuse(format!("allowed is {low} to {high} {}", feature.unit));
            }
            (Range::OneOf(words), _) if !words.iter().any(|w| w == value) => {
                return refuse(format!("allowed are {}", words.join(", ")));
            }
            _ => {}
        }
        if !feature.writable {
            return refuse("it can only be read now".into());
        }
        if feature.value == Some(Value::Command) {
            return self.camera.execute_command(name).map_err(|e| said(name, &e));
        }
        self.camera.set(name, value).map_err(|e| said(&format!("{name} = {value}"), &e))?;
        self.look()
    }

    fn name(&self) -> String {
        format!("gige://{}", self.word)
    }

    fn device(&self) -> String {
        format!("gige://{}", self.serial)
    }
}

impl Told for GigeCamera {
    fn value(&mut self, name: &str) -> Option<Value> {
        self.camera.invalidate(name);
        feature(&mut self.camera, name)?.value
    }

    fn choose(&mut self, name: &str, entry: &str) -> Result<()> {
        self.camera.set(name, entry).map_err(|e| said(&format!("{name} = {entry}"), &e))
    }
}

impl GigeCamera {
    /// The next event from the network.
    fn receive(&mut self, within: Duration) -> Event {
        if self.stream.is_none()
            && let Err(fault) = self.start()
        {
            return Event::Lost(fault);
        }
        let stream = self.stream.as_mut().expect("started above");
        let got = stream.next(within);
        self.resent = stream.resent();
        match got {
            Got::Frame(frame) => self.taken(frame),
            Got::Broken(number, why) => {
                self.heard = Instant::now();
                match self.numbers.on_from(number) {
                    Some(id) => Event::Incomplete { id, why },
                    None => self.gone(&format!("its count began again, at {number}: it was reset")),
                }
            }
            Got::Ended(why) => self.gone(&why),
            Got::Nothing => {
                if let Some(n) = self.stream.as_ref().and_then(Delivery::foreign) {
                    return self.other_payload(n);
                }
                if self.heard.elapsed() < SILENCE {
                    return Event::Quiet;
                }
                self.heard = Instant::now();
                // A camera that waits for a trigger sends nothing but answers queries.
                let there = self.camera.transport().control_state() == ControlState::Held;
                self.camera.invalidate("Width");
                match self.camera.get_integer("Width") {
                    Ok(_) if there => Event::Quiet,
                    Ok(_) => self.gone("control of the camera was lost"),
                    Err(e) => self.gone(&format!("does not answer: {e}")),
                }
            }
        }
    }

    fn other_payload(&mut self, packets: u64) -> Event {
        self.foreign = true;
        Event::Lost(
            Fault::input(format!("gige://{}: {packets} packets of another payload than a picture", self.word))
                .cause("the camera sends GenDC, files, or parts that it does not announce")
                .next("choose a payload of pictures, or one component: sheetlight camera show"),
        )
    }
}

impl Drop for GigeCamera {
    fn drop(&mut self) {
        if self.stream.take().is_some() {
            let _ = self.camera.acquisition_stop();
        }
    }
}
