//! In: a module of the producer. Out: what it says of itself: its features with their description, and its port.

use crate::camera::{self, Camera};
use crate::config::Origin;
use crate::features::{COUNT, Category, Choice, Feature, Kind, Most, Table, Value, Values, free, shown};
use crate::library::{self, INTERFACE, Interface, Object};
use crate::standard::{access, error};
use crate::status::{Result, refuse};
use crate::stream::Acquirer;
use sheetlight::fault::Fault;
use std::sync::atomic::Ordering;
use std::sync::{Arc, LazyLock};

pub const VENDOR: &str = "Sheetlight";
pub const MODEL: &str = "Sheetlight GenTL Producer";
pub const VERSION: &str = env!("CARGO_PKG_VERSION");
/// The one data stream of a device.
pub const STREAM: &str = "stream0";
/// Type of the transport layer: none of the standard's.
pub const TYPE: &str = "Custom";

/// A table with its description.
pub struct Described {
    pub table: Table,
    pub xml: String,
}

/// What a handle of a port stands for.
pub struct Port {
    pub described: &'static Described,
    pub values: Arc<dyn Values>,
    /// Name of the module in the standard.
    pub module: &'static str,
    pub id: String,
}

impl Port {
    pub fn of(object: &Object) -> Result<Port> {
        let port = |described: &'static LazyLock<Described>, values: Arc<dyn Values>, module, id: &str| Port {
            described,
            values,
            module,
            id: id.to_owned(),
        };
        Ok(match object {
            Object::System => port(&SYSTEM, Arc::new(System), "TLSystem", INTERFACE),
            Object::Interface(i) => port(&INTERFACE_TABLE, i.clone(), "TLInterface", INTERFACE),
            Object::Device(c) => port(&DEVICE, Arc::new(Local(c.clone())), "TLDevice", &c.device.id),
            Object::Remote(c) => port(&REMOTE, c.clone(), "Device", &c.device.id),
            Object::Stream(s) => port(&STREAM_TABLE, Arc::new(OfStream(s.clone())), "TLDataStream", STREAM),
            Object::Event(_) => return refuse(error::INVALID_HANDLE, "an event has no port"),
        })
    }

    /// The file's name in its URL.
    pub fn file(&self) -> String {
        format!("sheetlight_{}.xml", self.module.to_lowercase())
    }

    pub fn url(&self) -> String {
        let (at, length) = (crate::features::XML_AT, self.described.xml.len());
        format!("local:{};{at:x};{length:x}?SchemaVersion=1.1.0", self.file())
    }

    pub fn read(&self, address: u64, length: usize) -> Result<Vec<u8>> {
        self.described.table.read(self.described.xml.as_bytes(), &*self.values, address, length)
    }

    pub fn write(&self, address: u64, bytes: &[u8]) -> Result<()> {
        self.described.table.write(&*self.values, address, bytes)
    }
}

static SYSTEM: LazyLock<Described> = LazyLock::new(|| describe("TLSystem", system()));
static INTERFACE_TABLE: LazyLock<Described> = LazyLock::new(|| describe("TLInterface", interface()));
static DEVICE: LazyLock<Described> = LazyLock::new(|| describe("TLDevice", device()));
static STREAM_TABLE: LazyLock<Described> = LazyLock::new(|| describe("TLDataStream", stream()));
static REMOTE: LazyLock<Described> = LazyLock::new(|| with_xml(camera::table()));

fn describe(module: &'static str, features: Vec<Feature>) -> Described {
    let name = match module {
        "TLSystem" => "SystemInformation",
        "TLInterface" => "InterfaceInformation",
        "TLDevice" => "DeviceInformation",
        _ => "StreamInformation",
    };
    with_xml(Table { module, categories: vec![Category { name, features }] })
}

fn with_xml(table: Table) -> Described {
    let xml = table.xml();
    Described { table, xml }
}

const fn choice(name: &'static str, value: i64) -> Choice {
    Choice { name, value, when: None }
}

const TYPES: Kind = Kind::Choice(const { &[choice("Custom", 0)] });

fn system() -> Vec<Feature> {
    vec![
        shown("TLID", "Identifier of the producer", Kind::Text),
        shown("TLVendorName", "Maker of the producer", Kind::Text),
        shown("TLModelName", "Name of the producer", Kind::Text),
        shown("TLVersion", "Version of the producer", Kind::Text),
        shown("TLPath", "Path of the library", Kind::Text),
        shown("TLType", "Kind of transport", TYPES),
        shown("GenTLVersionMajor", "Version of GenTL", COUNT),
        shown("GenTLVersionMinor", "Version of GenTL", COUNT),
        free("InterfaceUpdateList", "Reads the list of interfaces", Kind::Command),
        free("InterfaceSelector", "The interface to read", Kind::Integer { least: 0, most: Most::Is(0) })
            .selecting(&["InterfaceID", "InterfaceType"]),
        shown("InterfaceID", "Identifier of the interface", Kind::Text),
        shown("InterfaceType", "Kind of transport", TYPES),
    ]
}

fn interface() -> Vec<Feature> {
    const STATUS: &[Choice] = &[choice("ReadWrite", 0), choice("NoAccess", 1), choice("OpenReadWrite", 2)];
    vec![
        shown("InterfaceID", "Identifier of the interface", Kind::Text),
        shown("InterfaceType", "Kind of transport", TYPES),
        free("DeviceUpdateList", "Reads the list of devices", Kind::Command),
        shown("SheetlightDeviceLimit", "Greatest value of DeviceSelector", COUNT),
        free(
            "DeviceSelector",
            "The device to read",
            Kind::Integer { least: 0, most: Most::Of("SheetlightDeviceLimit") },
        )
        .selecting(&[
            "DeviceID",
            "DeviceVendorName",
            "DeviceModelName",
            "DeviceSerialNumber",
            "DeviceUserID",
            "DeviceAccessStatus",
            "SheetlightDeviceFault",
        ]),
        shown("DeviceID", "Identifier of the device", Kind::Text),
        shown("DeviceVendorName", "Maker of the device", Kind::Text),
        shown("DeviceModelName", "Where its frames come from", Kind::Text),
        shown("DeviceSerialNumber", "Identifier of the device", Kind::Text),
        shown("DeviceUserID", "Name of the device", Kind::Text),
        shown("DeviceAccessStatus", "Whether it can be opened", Kind::Choice(STATUS)),
        shown("SheetlightDeviceFault", "Why it cannot be opened", Kind::Text),
    ]
}

fn device() -> Vec<Feature> {
    vec![
        shown("DeviceID", "Identifier of the device", Kind::Text),
        shown("DeviceVendorName", "Maker of the device", Kind::Text),
        shown("DeviceModelName", "Where its frames come from", Kind::Text),
        shown("DeviceSerialNumber", "Identifier of the device", Kind::Text),
        shown("DeviceUserID", "Name of the device", Kind::Text),
        shown("DeviceType", "Kind of transport", TYPES),
        free("StreamSelector", "The data stream to read", Kind::Integer { least: 0, most: Most::Is(0) })
            .selecting(&["StreamID"]),
        shown("StreamID", "Identifier of the data stream", Kind::Text),
    ]
}

fn stream() -> Vec<Feature> {
    const HANDLING: Kind = Kind::Choice(const { &[choice("OldestFirst", 0)] });
    vec![
        shown("StreamID", "Identifier of the data stream", Kind::Text),
        shown("StreamType", "Kind of transport", TYPES),
        shown("StreamBufferHandlingMode", "No frame is replaced", HANDLING),
        shown("StreamAnnounceBufferMinimum", "Fewest buffers", COUNT),
        shown("StreamAnnouncedBufferCount", "Announced buffers", COUNT),
        shown("StreamInputBufferCount", "Buffers that wait for a frame", COUNT),
        shown("StreamOutputBufferCount", "Frames that wait for the program", COUNT),
        shown("StreamStartedFrameCount", "Frames begun", COUNT),
        shown("StreamDeliveredFrameCount", "Frames given", COUNT),
        shown("StreamLostFrameCount", "Frames lost: none, the next frame waits for a buffer", COUNT),
        shown("StreamIsGrabbing", "Whether the stream is started", Kind::Boolean),
    ]
}

fn text(text: &str) -> Value {
    Value::Text(text.to_owned())
}

fn no_value<T>(name: &str) -> Result<T> {
    refuse(error::ERROR, format!("{name} has no value"))
}

struct System;

impl Values for System {
    fn get(&self, name: &str) -> Result<Value> {
        Ok(match name {
            "TLID" | "InterfaceID" => text(INTERFACE),
            "TLVendorName" => text(VENDOR),
            "TLModelName" => text(MODEL),
            "TLVersion" => text(VERSION),
            "TLPath" => text(&path()),
            "GenTLVersionMajor" => Value::Integer(1),
            "GenTLVersionMinor" => Value::Integer(5),
            "TLType" | "InterfaceType" | "InterfaceSelector" => Value::Integer(0),
            other => return no_value(other),
        })
    }
    fn set(&self, _: &str, _: Value) -> Result<()> {
        Ok(())
    }
}

impl Values for Interface {
    fn get(&self, name: &str) -> Result<Value> {
        let selected = self.selected.load(Ordering::Relaxed);
        library::with(|library| {
            let limit = library.devices.len().saturating_sub(1);
            let known = ["InterfaceID", "InterfaceType", "SheetlightDeviceLimit", "DeviceSelector"];
            let at = usize::try_from(selected).unwrap_or(0).min(limit);
            let entry = library.devices.get(at);
            if entry.is_none() && !known.contains(&name) {
                return refuse(error::NOT_AVAILABLE, "the list of devices was not read: DeviceUpdateList reads it");
            }
            let of = |what: fn(&crate::config::Entry) -> String| Value::Text(entry.map(what).unwrap_or_default());
            Ok(match name {
                "InterfaceID" => text(INTERFACE),
                "InterfaceType" => Value::Integer(0),
                "SheetlightDeviceLimit" => Value::Integer(limit as i64),
                "DeviceSelector" => Value::Integer(at as i64),
                "DeviceID" | "DeviceSerialNumber" => of(|(d, _)| d.id.clone()),
                "DeviceVendorName" => text(VENDOR),
                "DeviceModelName" => of(|(d, _)| d.model().into()),
                "DeviceUserID" => of(|(d, _)| d.shown_name().into()),
                "DeviceAccessStatus" => Value::Integer(match entry.map(|e| status(library, e)) {
                    Some(access::STATUS_READWRITE) => 0,
                    Some(access::STATUS_OPEN_READWRITE) => 2,
                    _ => 1,
                }),
                "SheetlightDeviceFault" => of(|e| fault(e).unwrap_or_default()),
                other => return no_value(other),
            })
        })
    }
    fn set(&self, name: &str, value: Value) -> Result<()> {
        match (name, value) {
            ("DeviceSelector", Value::Integer(n)) => {
                self.selected.store(n, Ordering::Relaxed);
                Ok(())
            }
            _ => library::with(|library| {
                library.update_devices();
                Ok(())
            }),
        }
    }
}

/// Why a device cannot be opened, as far as it is seen without reading its clouds.
pub fn fault((_, origin): &crate::config::Entry) -> Option<String> {
    use sheetlight::{recording::Recording, rig::Rig, station};
    let tried = match origin.as_ref().map_err(Clone::clone) {
        Err(fault) => Err(fault),
        Ok(Origin::Scan(scan)) => station::load_report(scan).map(|_| ()),
        Ok(Origin::Recording { recording, station, .. }) => Recording::open(recording)
            .and_then(|_| station::Settings::load(station))
            .and_then(|_| Rig::load(station))
            .map(|_| ()),
        Ok(Origin::Simulated { made, .. }) => crate::source::options(made, 0).check(),
        Ok(Origin::Folder { folder, .. }) => std::fs::read_dir(folder).map(|_| ()).map_err(|e| Fault::read(folder, e)),
    };
    tried.err().map(|fault| fault.to_string())
}

/// Whether a device can be opened.
pub fn status(library: &library::Library, entry: &crate::config::Entry) -> i32 {
    match fault(entry) {
        _ if library.is_open(&entry.0.id) => access::STATUS_OPEN_READWRITE,
        Some(_) => access::STATUS_NOACCESS,
        None => access::STATUS_READWRITE,
    }
}

struct Local(Arc<Camera>);

impl Values for Local {
    fn get(&self, name: &str) -> Result<Value> {
        let device = &self.0.device;
        Ok(match name {
            "DeviceID" | "DeviceSerialNumber" => text(&device.id),
            "DeviceVendorName" => text(VENDOR),
            "DeviceModelName" => text(device.model()),
            "DeviceUserID" => text(device.shown_name()),
            "DeviceType" | "StreamSelector" => Value::Integer(0),
            "StreamID" => text(STREAM),
            other => return no_value(other),
        })
    }
    fn set(&self, _: &str, _: Value) -> Result<()> {
        Ok(())
    }
}

struct OfStream(Arc<Acquirer>);

impl Values for OfStream {
    fn get(&self, name: &str) -> Result<Value> {
        self.0.with(|s| {
            Ok(match name {
                "StreamID" => text(STREAM),
                "StreamType" | "StreamBufferHandlingMode" | "StreamLostFrameCount" => Value::Integer(0),
                "StreamAnnounceBufferMinimum" => Value::Integer(1),
                "StreamAnnouncedBufferCount" => Value::Integer(s.buffers.len() as i64),
                "StreamInputBufferCount" => Value::Integer(s.input.len() as i64),
                "StreamOutputBufferCount" => Value::Integer(s.awaiting() as i64),
                "StreamStartedFrameCount" => Value::Integer(s.started as i64),
                "StreamDeliveredFrameCount" => Value::Integer(s.delivered as i64),
                "StreamIsGrabbing" => Value::Integer(i64::from(s.to_acquire.is_some())),
                other => return no_value(other),
            })
        })
    }
    fn set(&self, name: &str, _: Value) -> Result<()> {
        no_value(name)
    }
}

/// The file that this library was loaded from, as the system lists it.
pub fn path() -> String {
    let here = path as *const () as usize;
    let maps = std::fs::read_to_string("/proc/self/maps").unwrap_or_default();
    let found = maps.lines().find_map(|line| {
        let (range, rest) = line.split_once(' ')?;
        let (from, to) = range.split_once('-')?;
        let number = |hex| usize::from_str_radix(hex, 16).ok();
        (number(from)?..number(to)?).contains(&here).then(|| rest.find('/').map(|at| rest[at..].to_owned()))?
    });
    found.unwrap_or_else(|| "sheetlight.cti".into())
}
