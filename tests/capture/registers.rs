//! In: a picture, and what a test device sends. Out: its registers, and the description file (GenApi) that names them.
//! Frame and unit: big endian; addresses of the standard's bootstrap registers, and of its own from 0x10000.

use sheetlight::raster::Image;
use std::net::Ipv4Addr;

pub const WIDTH: u32 = 0x10000;
pub const HEIGHT: u32 = 0x10004;
pub const FORMAT: u32 = 0x10008;
pub const PAYLOAD: u32 = 0x1000c;
pub const START: u32 = 0x10010;
pub const EXPOSURE: u32 = 0x10014;
pub const XML: u32 = 0x20000;
pub const CCP: u32 = 0x0a00;
pub const PORT: u32 = 0x0d00;
pub const PACKET: u32 = 0x0d04;
pub const ADDRESS: u32 = 0x0d18;
pub const LATCH: u32 = 0x0944;
pub const MONO8: u32 = 0x0108_0001;
pub const MONO12: u32 = 0x0110_0005;
pub const BAYER: u32 = 0x0108_0009;
/// PFNC's code of heights of 16 bits.
pub const COORD3D_C16: u32 = 0x0110_00b8;
/// Of a camera with two components: the selector, the pixel format of each, and whether each is sent.
pub const COMPONENT: u32 = 0x10080;
pub const FORMATS: u32 = 0x10084;
pub const ENABLED: u32 = 0x1008c;
/// Capabilities and configuration of the stream channel; the bit of multi-part payloads.
pub const CAN: u32 = 0x0d20;
pub const DOES: u32 = 0x0d24;
pub const PARTS: u32 = 0x40;
/// Of the 3D Scan Control: the output mode, the selector, and for each coordinate scale, offset and invalid number.
pub const MODE: u32 = 0x10020;
pub const SELECTOR: u32 = 0x10024;
pub const OF_AXES: u32 = 0x10030;

pub struct Registers {
    pub memory: Vec<u8>,
    pub xml: Vec<u8>,
}

impl Registers {
    pub fn put(&mut self, at: u32, value: u32) {
        let at = at as usize;
        self.memory[at..at + 4].copy_from_slice(&value.to_be_bytes());
    }
    pub fn get(&self, at: u32) -> u32 {
        let at = at as usize;
        self.memory.get(at..at + 4).map_or(0, |b| u32::from_be_bytes(b.try_into().unwrap()))
    }
    pub fn words(&mut self, at: usize, text: &str) {
        self.memory[at..at + text.len()].copy_from_slice(text.as_bytes());
    }
    pub fn read(&self, at: u32, length: usize) -> Vec<u8> {
        if at >= XML {
            let from = (at - XML) as usize;
            let mut out = self.xml.get(from..).unwrap_or_default().to_vec();
            out.resize(length, 0);
            return out;
        }
        let mut out =
            self.memory.get(at as usize..).unwrap_or_default().iter().take(length).copied().collect::<Vec<_>>();
        out.resize(length, 0);
        out
    }
}

pub fn registers(ip: Ipv4Addr, picture: &Image, deep: bool) -> Registers {
    let mut r = Registers { memory: vec![0; 0x10100], xml: xml(false, false).into_bytes() };
    r.put(0, 0x0001_0002);
    r.put(4, 0x8000_0001);
    r.put(0x0c, u32::from(ip));
    r.put(0x10, 7);
    r.put(0x14, 5);
    r.put(0x24, u32::from(ip));
    r.put(0x34, 0xff00_0000);
    r.words(0x48, "Sheetlight");
    r.words(0x68, "Test device");
    r.words(0x88, "1");
    r.words(0xd8, &format!("T{}", ip.octets()[3]));
    let url = format!("Local:test.xml;{XML:x};{:x}", r.xml.len());
    r.words(0x200, &url);
    r.put(0x600, 1);
    r.put(0x904, 1);
    // Write memory, packet resend.
    r.put(0x934, 0x0000_0006);
    r.put(0x938, 3000);
    r.put(0x940, 1_000_000_000);
    r.put(PACKET, 1500);
    r.put(WIDTH, picture.width);
    r.put(HEIGHT, picture.height);
    r.put(FORMAT, if deep { MONO12 } else { MONO8 });
    r.put(PAYLOAD, picture.width * picture.height * if deep { 2 } else { 1 });
    r.put(EXPOSURE, 1000.0f32.to_bits());
    r
}

/// An enumeration and its register of 4 bytes. `index`: the selector that moves the address, or nothing.
fn word(name: &str, at: u32, entries: &[(&str, u32)], index: &str) -> String {
    let of = |(n, v): &(&str, u32)| format!("<EnumEntry Name=\"{n}\"><Value>{v}</Value></EnumEntry>");
    let entries: String = entries.iter().map(of).collect();
    format!(
        "<Enumeration Name=\"{name}\">{entries}<pValue>{name}Reg</pValue></Enumeration><IntReg \
         Name=\"{name}Reg\"><Address>0x{at:x}</Address>{index}<Length>4</Length><AccessMode>RW</AccessMode>\
         <pPort>Device</pPort><Sign>Unsigned</Sign><Endianess>BigEndian</Endianess></IntReg>"
    )
}

/// The pixel format of every component, and whether it is sent; both lie 4 bytes apart, by the selector.
fn components() -> String {
    let index = "<pIndex Offset=\"4\">ComponentSelectorReg</pIndex>";
    [
        word("ComponentSelector", COMPONENT, &[("Reflectance", 0), ("Range", 1)], ""),
        word("PixelFormat", FORMATS, &[("Mono8", MONO8), ("Coord3D_C16", COORD3D_C16)], index),
        format!(
            "<Boolean Name=\"ComponentEnable\"><pValue>ComponentEnableReg</pValue></Boolean><IntReg \
             Name=\"ComponentEnableReg\"><Address>0x{ENABLED:x}</Address>{index}<Length>4</Length>\
             <AccessMode>RW</AccessMode><pPort>Device</pPort><Sign>Unsigned</Sign><Endianess>BigEndian</Endianess>\
             </IntReg>"
        ),
    ]
    .concat()
}

/// Features of the 3D Scan Control; those of a coordinate lie 16 bytes apart, by the selector.
fn scan3d() -> String {
    let word = |name: &str, at: u32, entries: &[(&str, u32)]| word(name, at, entries, "");
    let float = |name: &str, at: u32| {
        format!(
            "<Float Name=\"{name}\"><pValue>{name}Reg</pValue></Float><FloatReg Name=\"{name}Reg\">\
             <Address>0x{at:x}</Address><pIndex Offset=\"16\">Scan3dCoordinateSelectorReg</pIndex>\
             <Length>4</Length><AccessMode>RO</AccessMode><pPort>Device</pPort>\
             <Endianess>BigEndian</Endianess></FloatReg>"
        )
    };
    [
        word("Scan3dOutputMode", MODE, &[("UncalibratedC", 0), ("RectifiedC", 7)]),
        word("Scan3dDistanceUnit", 0x10028, &[("Millimeter", 0), ("Inch", 1)]),
        word("Scan3dCoordinateSelector", SELECTOR, &[("CoordinateA", 0), ("CoordinateB", 1), ("CoordinateC", 2)]),
        float("Scan3dCoordinateScale", OF_AXES),
        float("Scan3dCoordinateOffset", OF_AXES + 4),
        float("Scan3dInvalidDataValue", OF_AXES + 8),
        "<Boolean Name=\"Scan3dInvalidDataFlag\"><Value>1</Value></Boolean>".into(),
    ]
    .concat()
}

/// The description file of a camera that sends heights, and several components.
pub fn xml(heights: bool, several: bool) -> String {
    let reg = |name: &str, at: u32, mode: &str| {
        format!(
            "<IntReg \
             Name=\"{name}Reg\"><Address>0x{at:x}</Address><Length>4</Length><AccessMode>{mode}</AccessMode>\
             <pPort>Device</pPort><Sign>Unsigned</Sign><Endianess>BigEndian</Endianess></IntReg>"
        )
    };
    let integer = |name: &str, at: u32| {
        format!(
            "<Integer Name=\"{name}\"><pValue>{name}Reg</pValue><Min>1</Min><Max>100000000</Max></Integer>{}",
            reg(name, at, "RW")
        )
    };
    let features = [
        "Width",
        "Height",
        "PayloadSize",
        "PixelFormat",
        "AcquisitionStart",
        "AcquisitionStop",
        "ExposureTime",
        "GevTimestampTickFrequency",
        "GevTimestampControlLatch",
        "GevTimestampValue",
    ];
    let more: &[&str] = if several { &["ComponentSelector", "ComponentEnable"] } else { &[] };
    let listed: String = features.iter().chain(more).map(|f| format!("<pFeature>{f}</pFeature>")).collect();
    let command = |name: &str, reg: &str, value: u32| {
        format!("<Command Name=\"{name}\"><pValue>{reg}</pValue><CommandValue>{value}</CommandValue></Command>")
    };
    let body = [
        format!("<Category Name=\"Root\">{listed}</Category>"),
        integer("Width", WIDTH),
        integer("Height", HEIGHT),
        integer("PayloadSize", PAYLOAD),
        if several {
            components()
        } else {
            let formats = [("Mono8", MONO8), ("BayerRG8", BAYER), ("Coord3D_C16", COORD3D_C16), ("Mono12", MONO12)];
            word("PixelFormat", FORMAT, &formats, "")
        },
        reg("Acquisition", START, "RW"),
        command("AcquisitionStart", "AcquisitionReg", 1),
        command("AcquisitionStop", "AcquisitionReg", 0),
        "<Float \
         Name=\"ExposureTime\"><pValue>ExposureTimeReg</pValue><Min>10</Min><Max>1000000</Max><Unit>us</Unit>\
         </Float>"
            .into(),
        format!(
            "<FloatReg \
                 Name=\"ExposureTimeReg\"><Address>0x{EXPOSURE:x}</Address><Length>4</Length>\
                 <AccessMode>RW</AccessMode><pPort>Device</pPort><Endianess>BigEndian</Endianess></FloatReg>"
        ),
        integer("GevTimestampTickFrequency", 0x940),
        reg("Latch", LATCH, "WO"),
        command("GevTimestampControlLatch", "LatchReg", 2),
        "<Integer Name=\"GevTimestampValue\"><pValue>GevTimestampValueReg</pValue></Integer>".into(),
        "<IntReg \
         Name=\"GevTimestampValueReg\"><Address>0x948</Address><Length>8</Length><AccessMode>RO</AccessMode>\
         <pPort>Device</pPort><Cachable>NoCache</Cachable><Sign>Unsigned</Sign><Endianess>BigEndian</Endianess>\
         </IntReg>"
            .into(),
        if heights { scan3d() } else { String::new() },
        "<Port Name=\"Device\"></Port>".into(),
    ];
    format!(
        "<?xml version=\"1.0\" encoding=\"utf-8\"?><RegisterDescription ModelName=\"Test\" VendorName=\"Sheetlight\" \
         StandardNameSpace=\"GEV\" SchemaMajorVersion=\"1\" SchemaMinorVersion=\"1\" SchemaSubMinorVersion=\"0\" \
         MajorVersion=\"1\" MinorVersion=\"0\" SubMinorVersion=\"0\" ToolTip=\"\" \
         ProductGuid=\"11111111-1111-1111-1111-111111111111\" VersionGuid=\"11111111-1111-1111-1111-111111111112\" \
         xmlns=\"http://www.genicam.org/GenApi/Version_1_1\">{}</RegisterDescription>",
        body.concat()
    )
}
