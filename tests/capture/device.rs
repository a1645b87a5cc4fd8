//! In: pictures. Out: a GigE Vision camera on a loopback address that sends them: GVCP on UDP port 3956, GVSP to whom
//! the stream channel names, lost packets on request; test equipment, written after the standard's registers.
//! Frame and unit: big endian on the wire; times in ns.

use sheetlight::raster::{Image, Pixels};
use std::collections::VecDeque;
use std::net::{Ipv4Addr, SocketAddr, UdpSocket};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

const WIDTH: u32 = 0x10000;
const HEIGHT: u32 = 0x10004;
const FORMAT: u32 = 0x10008;
const PAYLOAD: u32 = 0x1000c;
const START: u32 = 0x10010;
const EXPOSURE: u32 = 0x10014;
const XML: u32 = 0x20000;
const CCP: u32 = 0x0a00;
const PORT: u32 = 0x0d00;
const PACKET: u32 = 0x0d04;
const ADDRESS: u32 = 0x0d18;
const LATCH: u32 = 0x0944;
const MONO8: u32 = 0x0108_0001;
const MONO12: u32 = 0x0110_0005;
const BAYER: u32 = 0x0108_0009;
/// PFNC's code of heights of 16 bits.
const COORD3D_C16: u32 = 0x0110_00b8;
/// Of the 3D Scan Control: the output mode, the selector, and for each coordinate scale, offset and invalid number.
const MODE: u32 = 0x10020;
const SELECTOR: u32 = 0x10024;
const OF_AXES: u32 = 0x10030;

/// What the camera does wrong.
#[derive(Clone, Copy, Default)]
pub struct Faults {
    /// Of a thousand packets so many are lost.
    pub lost_per_mille: u64,
    /// It sends again what is asked for.
    pub resends: bool,
    /// It sends colours.
    pub colour: bool,
    /// It sends heights: the levels are of Coord3D_C16, with these scales and offsets of A and C, mm; 0 is invalid.
    pub heights: Option<[[f32; 2]; 2]>,
    /// Its output mode is UncalibratedC.
    pub uncalibrated: bool,
    /// It sends payloads of several parts.
    pub multipart: bool,
    /// After so many pictures its clock goes on by so many ns.
    pub jump: Option<(u64, u64)>,
    /// Its first picture has this number; 0: 1.
    pub first: u64,
    /// Every so many pictures one is taken and not sent at all; 0: none.
    pub skips: u64,
}

impl Faults {
    /// What its clock says after so many pictures.
    fn clock(&self, begun: Instant, taken: u64) -> u64 {
        let jumped = self.jump.filter(|(after, _)| taken > *after).map_or(0, |(_, by)| by);
        begun.elapsed().as_nanos() as u64 + jumped
    }
}

struct Registers {
    memory: Vec<u8>,
    xml: Vec<u8>,
}

impl Registers {
    fn put(&mut self, at: u32, value: u32) {
        let at = at as usize;
        self.memory[at..at + 4].copy_from_slice(&value.to_be_bytes());
    }
    fn get(&self, at: u32) -> u32 {
        let at = at as usize;
        self.memory.get(at..at + 4).map_or(0, |b| u32::from_be_bytes(b.try_into().unwrap()))
    }
    fn words(&mut self, at: usize, text: &str) {
        self.memory[at..at + text.len()].copy_from_slice(text.as_bytes());
    }
    fn read(&self, at: u32, length: usize) -> Vec<u8> {
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

/// A camera that runs.
pub struct Device {
    stop: Arc<AtomicBool>,
    /// Pictures taken, and packets that were lost on purpose.
    pub taken: Arc<AtomicU64>,
    pub lost: Arc<AtomicU64>,
    threads: Vec<std::thread::JoinHandle<()>>,
}

impl Device {
    /// On this loopback address, at this rate, `count` pictures in all.
    pub fn start(ip: Ipv4Addr, pictures: Vec<Image>, rate_hz: f64, count: u64, faults: Faults) -> Device {
        let control = UdpSocket::bind((ip, 3956)).expect("a loopback address of its own");
        control.set_read_timeout(Some(Duration::from_millis(20))).unwrap();
        let data = UdpSocket::bind((ip, 0)).unwrap();
        let deep = matches!(pictures[0].pixels, Pixels::U16(_));
        let registers = Arc::new(Mutex::new(registers(ip, &pictures[0], deep)));
        if faults.colour {
            registers.lock().unwrap().put(FORMAT, BAYER);
        }
        if let Some([a, c]) = faults.heights {
            let mut r = registers.lock().unwrap();
            r.xml = xml(true).into_bytes();
            let url = format!("Local:test.xml;{XML:x};{:x}", r.xml.len());
            r.words(0x200, &url);
            r.put(FORMAT, COORD3D_C16);
            r.put(MODE, if faults.uncalibrated { 0 } else { 7 });
            for (axis, [scale, offset]) in [(0, a), (2, c)] {
                r.put(OF_AXES + 16 * axis, scale.to_bits());
                r.put(OF_AXES + 16 * axis + 4, offset.to_bits());
            }
        }
        let (stop, taken, lost) =
            (Arc::new(AtomicBool::new(false)), Arc::new(AtomicU64::new(0)), Arc::new(AtomicU64::new(0)));
        let sent: Arc<Mutex<VecDeque<(u64, Vec<Vec<u8>>)>>> = Arc::default();
        let begun = Instant::now();
        let (stopped, map, old, out) = (stop.clone(), registers.clone(), sent.clone(), data.try_clone().unwrap());
        let counted = taken.clone();
        let answer = move || answer(&control, &out, &map, &old, &stopped, faults, begun, &counted);
        let (stopped, map, counted, dropped) = (stop.clone(), registers, taken.clone(), lost.clone());
        let stream =
            move || stream(&data, &pictures, rate_hz, count, faults, &map, &sent, &stopped, &counted, &dropped, begun);
        let threads = vec![std::thread::spawn(answer), std::thread::spawn(stream)];
        Device { stop, taken, lost, threads }
    }

    /// Its cable is pulled.
    pub fn unplug(mut self) -> u64 {
        self.stop.store(true, Ordering::Relaxed);
        self.threads.drain(..).for_each(|t| t.join().unwrap());
        self.taken.load(Ordering::Relaxed)
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        self.threads.drain(..).for_each(|t| drop(t.join()));
    }
}

fn registers(ip: Ipv4Addr, picture: &Image, deep: bool) -> Registers {
    let mut r = Registers { memory: vec![0; 0x10100], xml: xml(false).into_bytes() };
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

/// Features of the 3D Scan Control; those of a coordinate lie 16 bytes apart, by the selector.
fn scan3d() -> String {
    let word = |name: &str, at: u32, entries: &[(&str, u32)]| {
        let of = |(n, v): &(&str, u32)| format!("<EnumEntry Name=\"{n}\"><Value>{v}</Value></EnumEntry>");
        let entries: String = entries.iter().map(of).collect();
        format!(
            "<Enumeration Name=\"{name}\">{entries}<pValue>{name}Reg</pValue></Enumeration><IntReg \
             Name=\"{name}Reg\"><Address>0x{at:x}</Address><Length>4</Length><AccessMode>RW</AccessMode>\
             <pPort>Device</pPort><Sign>Unsigned</Sign><Endianess>BigEndian</Endianess></IntReg>"
        )
    };
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

fn xml(heights: bool) -> String {
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
    let listed: String = features.iter().map(|f| format!("<pFeature>{f}</pFeature>")).collect();
    let command = |name: &str, reg: &str, value: u32| {
        format!("<Command Name=\"{name}\"><pValue>{reg}</pValue><CommandValue>{value}</CommandValue></Command>")
    };
    let body = [
        format!("<Category Name=\"Root\">{listed}</Category>"),
        integer("Width", WIDTH),
        integer("Height", HEIGHT),
        integer("PayloadSize", PAYLOAD),
        format!(
            "<Enumeration Name=\"PixelFormat\"><EnumEntry \
                 Name=\"Mono8\"><Value>{MONO8}</Value></EnumEntry><EnumEntry \
                 Name=\"BayerRG8\"><Value>{BAYER}</Value></EnumEntry><EnumEntry \
                 Name=\"Coord3D_C16\"><Value>{COORD3D_C16}</Value></EnumEntry><EnumEntry \
                 Name=\"Mono12\"><Value>{MONO12}</Value></EnumEntry><pValue>PixelFormatReg</pValue></Enumeration>"
        ),
        reg("PixelFormat", FORMAT, "RW"),
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

type Sent = Mutex<VecDeque<(u64, Vec<Vec<u8>>)>>;

#[allow(clippy::too_many_arguments)]
fn answer(
    control: &UdpSocket,
    data: &UdpSocket,
    registers: &Mutex<Registers>,
    sent: &Sent,
    stop: &AtomicBool,
    faults: Faults,
    begun: Instant,
    taken: &AtomicU64,
) {
    let mut buffer = [0; 2048];
    while !stop.load(Ordering::Relaxed) {
        let Ok((n, from)) = control.recv_from(&mut buffer) else { continue };
        if n < 8 || buffer[0] != 0x42 {
            continue;
        }
        let half = |at: usize| u16::from_be_bytes([buffer[at], buffer[at + 1]]);
        let word = |at: usize| u32::from_be_bytes(buffer[at..at + 4].try_into().unwrap());
        let (command, id) = (half(2), half(6));
        let mut r = registers.lock().unwrap();
        let payload = match command {
            0x0002 => r.read(0, 0xf8),
            0x0080 => (8..n).step_by(4).flat_map(|at| r.get(word(at)).to_be_bytes()).collect(),
            0x0082 => {
                for at in (8..n).step_by(8) {
                    let (register, value) = (word(at), word(at + 4));
                    r.put(register, value);
                    if register == LATCH {
                        let now = faults.clock(begun, taken.load(Ordering::Relaxed));
                        r.put(0x948, (now >> 32) as u32);
                        r.put(0x94c, now as u32);
                    }
                    // A test packet of the size that is tried.
                    if register == PACKET && value >> 31 == 1 {
                        let to = SocketAddr::from((Ipv4Addr::from(r.get(ADDRESS)), r.get(PORT) as u16));
                        let _ = data.send_to(&vec![0; (value & 0xffff) as usize - 28], to);
                    }
                }
                (((n - 8) / 8) as u32).to_be_bytes().to_vec()
            }
            0x0084 => {
                let mut out = buffer[8..12].to_vec();
                out.extend(r.read(word(8), half(14) as usize));
                out
            }
            0x0086 => {
                let at = word(8) as usize;
                let bytes = buffer[12..n].to_vec();
                if let Some(place) = r.memory.get_mut(at..at + bytes.len()) {
                    place.copy_from_slice(&bytes);
                }
                (bytes.len() as u32).to_be_bytes().to_vec()
            }
            0x0040 if faults.resends => {
                let to = SocketAddr::from((Ipv4Addr::from(r.get(ADDRESS)), r.get(PORT) as u16));
                let (block, first, last) = (u64::from(half(10)), word(12) & 0xff_ffff, word(16) & 0xff_ffff);
                if let Some((_, packets)) = sent.lock().unwrap().iter().find(|(b, _)| *b == block) {
                    let wanted = packets.iter().skip(first as usize).take((last - first + 1) as usize);
                    wanted.for_each(|p| drop(data.send_to(p, to)));
                }
                continue;
            }
            _ => continue,
        };
        let mut out = vec![0, 0];
        out.extend((command + 1).to_be_bytes());
        out.extend((payload.len() as u16).to_be_bytes());
        out.extend(id.to_be_bytes());
        out.extend(payload);
        let _ = control.send_to(&out, from);
    }
}

fn packets(picture: &Image, block: u64, ns: u64, size: usize, faults: Faults) -> Vec<Vec<u8>> {
    let (bytes, code): (Vec<u8>, u32) = match &picture.pixels {
        Pixels::U8(p) => (p.clone(), MONO8),
        Pixels::U16(p) => (p.iter().flat_map(|l| l.to_le_bytes()).collect(), MONO12),
    };
    let code = if faults.heights.is_some() { COORD3D_C16 } else { code };
    let (payload, data) = if faults.multipart { (10, 7) } else { (1, 3) };
    let head = |kind: u8, number: u32| {
        let mut out = vec![0, 0];
        out.extend((block as u16).to_be_bytes());
        out.push(kind);
        out.extend(&number.to_be_bytes()[1..]);
        out
    };
    let mut leader = head(1, 0);
    leader.extend([0, 0, 0, payload]);
    leader.extend(ns.to_be_bytes());
    [code, picture.width, picture.height, 0, 0, 0].iter().for_each(|w| leader.extend(w.to_be_bytes()));
    let mut all = vec![leader];
    for chunk in bytes.chunks(size - 36) {
        let mut packet = head(data, all.len() as u32);
        packet.extend(chunk);
        all.push(packet);
    }
    let mut trailer = head(2, all.len() as u32);
    trailer.extend([0, 0, 0, payload]);
    trailer.extend(picture.height.to_be_bytes());
    all.push(trailer);
    all
}

#[allow(clippy::too_many_arguments)]
fn stream(
    data: &UdpSocket,
    pictures: &[Image],
    rate_hz: f64,
    count: u64,
    faults: Faults,
    registers: &Mutex<Registers>,
    sent: &Sent,
    stop: &AtomicBool,
    taken: &AtomicU64,
    lost: &AtomicU64,
    begun: Instant,
) {
    let period = Duration::from_secs_f64(1.0 / rate_hz);
    let mut dice = 12345u64;
    let mut next: Option<Instant> = None;
    while !stop.load(Ordering::Relaxed) {
        let (running, to, size) = {
            let r = registers.lock().unwrap();
            let to = SocketAddr::from((Ipv4Addr::from(r.get(ADDRESS)), r.get(PORT) as u16));
            (r.get(START) == 1 && r.get(CCP) != 0 && to.port() != 0, to, (r.get(PACKET) & 0xffff) as usize)
        };
        let done = taken.load(Ordering::Relaxed);
        if !running || done >= count {
            next = None;
            std::thread::sleep(Duration::from_millis(1));
            continue;
        }
        let due = *next.get_or_insert_with(Instant::now);
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
        // A camera does not stand still with the machine that plays it: what it did not take in time it takes later,
        // never at once.
        next = Some((due + period).max(Instant::now()));
        taken.store(done + 1, Ordering::Relaxed);
        if faults.skips > 0 && done % faults.skips == faults.skips - 1 {
            continue;
        }
        // Numbers of 16 bits without 0.
        let block = (done + faults.first.saturating_sub(1)) % 65_535 + 1;
        let ns = faults.clock(begun, done);
        let all = packets(&pictures[done as usize % pictures.len()], block, ns, size, faults);
        for packet in &all {
            dice = dice.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            if (dice >> 33) % 1000 < faults.lost_per_mille {
                lost.fetch_add(1, Ordering::Relaxed);
                continue;
            }
            let _ = data.send_to(packet, to);
        }
        let mut kept = sent.lock().unwrap();
        kept.push_back((block, all));
        if kept.len() > 8 {
            kept.pop_front();
        }
    }
}
