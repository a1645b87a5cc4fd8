//! In: pictures. Out: a GigE Vision camera on a loopback address that sends them: GVCP on UDP port 3956, GVSP to whom
//! the stream channel names, lost packets on request; test equipment, written after the standard's registers.
//! Frame and unit: big endian on the wire; times in ns.

use super::registers::{
    ADDRESS, BAYER, CAN, CCP, COMPONENT, COORD3D_C16, DOES, ENABLED, FORMAT, FORMATS, LATCH, MODE, MONO8, MONO12,
    OF_AXES, PACKET, PARTS, PORT, Registers, START, XML, registers, xml,
};
use sheetlight::raster::{Image, Pixels};
use std::collections::VecDeque;
use std::net::{Ipv4Addr, SocketAddr, UdpSocket};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

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
    pub several: Option<Several>,
    /// After so many pictures its clock goes on by so many ns.
    pub jump: Option<(u64, u64)>,
    /// Its first picture has this number; 0: 1.
    pub first: u64,
    /// Every so many pictures one is taken and not sent at all; 0: none.
    pub skips: u64,
}

/// How a camera sends several components in a payload: each place's number, and a reflectance of its low byte.
#[derive(Clone, Copy, PartialEq)]
pub enum Several {
    /// After the standard: it announces them, and sends them if the receiver asks for them.
    Told,
    /// It does not announce them, and always sends them.
    Unsaid,
    /// Of a payload type that nobody reads.
    Foreign,
}

impl Faults {
    /// What its clock says after so many pictures.
    fn clock(&self, begun: Instant, taken: u64) -> u64 {
        let jumped = self.jump.filter(|(after, _)| taken > *after).map_or(0, |(_, by)| by);
        begun.elapsed().as_nanos() as u64 + jumped
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
            r.xml = xml(true, faults.several == Some(Several::Told)).into_bytes();
            let url = format!("Local:test.xml;{XML:x};{:x}", r.xml.len());
            r.words(0x200, &url);
            r.put(FORMAT, COORD3D_C16);
            if faults.several == Some(Several::Told) {
                r.put(CAN, PARTS);
            }
            // The selected component is the one without heights.
            [(COMPONENT, 0), (FORMATS, MONO8), (FORMATS + 4, COORD3D_C16), (ENABLED, 1), (ENABLED + 4, 1)]
                .iter()
                .for_each(|(at, value)| r.put(*at, *value));
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
                let long = buffer[1] & 0x10 != 0;
                let (block, mask) = match long {
                    true => (u64::from(word(20)) << 32 | u64::from(word(24)), u32::MAX),
                    false => (u64::from(half(10)), 0xff_ffff),
                };
                let (first, last) = (word(12) & mask, word(16) & mask);
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

/// One part of a payload: its data type (1: an image, 5: one with depths), pixel format, bytes.
type Part = (u16, u32, Vec<u8>);

/// The parts that a camera with these faults sends of a picture.
fn parts(picture: &Image, registers: [u32; 3], faults: Faults) -> Vec<Part> {
    let (bytes, code): (Vec<u8>, u32) = match &picture.pixels {
        Pixels::U8(p) => (p.clone(), MONO8),
        Pixels::U16(p) => (p.iter().flat_map(|l| l.to_le_bytes()).collect(), MONO12),
    };
    let main = (5, if faults.heights.is_some() { COORD3D_C16 } else { code }, bytes);
    let light = (1, MONO8, main.2.iter().copied().step_by(2).collect());
    let [does, light_enabled, heights_enabled] = registers;
    match faults.several {
        Some(Several::Told) => {
            let enabled = [light_enabled, heights_enabled].into_iter().zip([light, main]);
            let sent = enabled.filter(|(on, _)| *on == 1).map(|(_, part)| part);
            // Who does not understand several parts gets the first.
            sent.take(if does & PARTS == 0 { 1 } else { 2 }).collect()
        }
        Some(_) => vec![light, main],
        None => vec![main],
    }
}

fn packets(size: [u32; 2], sent: &[Part], block: u64, ns: u64, packet: usize, faults: Faults) -> Vec<Vec<u8>> {
    let [width, height] = size;
    let several = faults.several.is_some() && sent.len() > 1;
    // Types of payload: image, several parts, GenDC. Formats of packets: data, data of parts, data of GenDC.
    let (payload, data) = match faults.several {
        Some(Several::Foreign) => (11, 8),
        _ if several => (10, 7),
        _ => (1, 3),
    };
    // Several parts come with numbers of 64 and 32 bits; where the short number was, the leader has how many there are.
    let head = |kind: u8, number: u32| {
        let mut out = vec![0, 0];
        if several {
            out.extend([0, 0, 0x80 | kind, 0, 0, if kind == 1 { sent.len() as u8 } else { 0 }]);
            out.extend(block.to_be_bytes());
            out.extend(number.to_be_bytes());
        } else {
            out.extend((block as u16).to_be_bytes());
            out.push(kind);
            out.extend(&number.to_be_bytes()[1..]);
        }
        out
    };
    let mut leader = head(1, 0);
    leader.extend([0, 0, 0, payload]);
    leader.extend(ns.to_be_bytes());
    if several {
        for (i, (kind, code, bytes)) in sent.iter().enumerate() {
            leader.extend(kind.to_be_bytes());
            leader.extend(&(bytes.len() as u64).to_be_bytes()[2..]);
            leader.extend(code.to_be_bytes());
            // One zone, from top to bottom; purpose and region.
            leader.extend([0, 0, 0, 0, 0, 0, 0, 0, 0, i as u8, 0, 0]);
            [width, height, 0, 0, 0, 0].iter().for_each(|w| leader.extend(w.to_be_bytes()));
        }
    } else {
        [sent[0].1, width, height, 0, 0, 0].iter().for_each(|w| leader.extend(w.to_be_bytes()));
    }
    // Places count from the beginning of the payload.
    let (mut all, mut before) = (vec![leader], 0);
    for (part, (_, _, bytes)) in sent.iter().enumerate() {
        let room = packet - if several { 56 } else { 36 };
        for (i, chunk) in bytes.chunks(room).enumerate() {
            let mut packet = head(data, all.len() as u32);
            if several {
                packet.extend([part as u8, 0]);
                packet.extend(&((before + i * room) as u64).to_be_bytes()[2..]);
            }
            packet.extend(chunk);
            all.push(packet);
        }
        before += bytes.len();
    }
    let mut trailer = head(2, all.len() as u32);
    trailer.extend([0, 0, 0, payload]);
    trailer.extend(height.to_be_bytes());
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
        let (running, to, packet, told) = {
            let r = registers.lock().unwrap();
            let to = SocketAddr::from((Ipv4Addr::from(r.get(ADDRESS)), r.get(PORT) as u16));
            (
                r.get(START) == 1 && r.get(CCP) != 0 && to.port() != 0,
                to,
                (r.get(PACKET) & 0xffff) as usize,
                [DOES, ENABLED, ENABLED + 4].map(|at| r.get(at)),
            )
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
        let picture = &pictures[done as usize % pictures.len()];
        let size = (picture.width, picture.height);
        let all = packets(size.into(), &parts(picture, told, faults), block, ns, packet, faults);
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
