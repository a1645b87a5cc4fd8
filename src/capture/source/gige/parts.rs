//! In: the packets of multi-part payloads (GigE Vision 2.1, payload type 10). Out: their parts, block by block; the
//! reason where a block is incomplete. The library for cameras assembles pictures and chunks only.
//! Frame and unit: bytes as the camera sent them; its clock in ticks.

use std::collections::{BTreeMap, VecDeque};
use std::time::{Duration, Instant};
use viva_genicam::gige::parse_header;

/// Packet formats, the low half of a packet's fifth byte.
const LEADER: u8 = 1;
const TRAILER: u8 = 2;
const PART_DATA: u8 = 7;
/// Payload type of a leader.
const MULTI_PART: u16 = 10;
/// Bytes of a leader before its parts, of a part in it, and before the data of a packet.
const BEFORE_PARTS: usize = 12;
const PART: usize = 48;
const BEFORE_DATA: usize = 8;
/// A block without a packet for so long is closed.
const OVERDUE: Duration = Duration::from_millis(100);
/// Blocks that are assembled at once: a camera sends one after the other, and packets arrive late by a few.
const OPEN: usize = 4;
/// Blocks whose late packets are known: a packet that was asked for may come twice, after blocks that follow.
const LATE: usize = 16;
/// Largest block, bytes: three components of 44 million pixels with 16 bits.
const LARGEST: u64 = 1 << 28;
/// Memory that a packet needs besides its data, bytes; the smallest packets of the standard carry 532 bytes.
const OVERHEAD: u64 = 64;

/// One part of a payload: an image of one component.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Part {
    /// The code of its pixel format (PFNC).
    pub code: u32,
    /// Size, px.
    pub size: [u32; 2],
    /// Bytes after each row.
    pub padding: u16,
    /// Its bytes.
    pub bytes: Vec<u8>,
}

/// The end of a block.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Block {
    /// All of it arrived: its number, its time in ticks, its parts.
    Whole(u64, u64, Vec<Part>),
    /// Its number, and why it cannot be used.
    Broken(u64, String),
}

/// A part as the leader announces it.
struct Announced {
    part: Part,
    length: u64,
}

/// A packet of data: the part that it belongs to, its place, its bytes.
type Piece = (u8, u64, Vec<u8>);

/// A block of which packets are still missing.
struct Open {
    id: u64,
    leader: Option<(u64, Vec<Announced>)>,
    pieces: BTreeMap<u32, Piece>,
    bytes: u64,
    /// Number of the trailer's packet, the last one.
    last: Option<u32>,
    /// Why it cannot become whole.
    fault: Option<String>,
    /// Whether its lost packets were asked for.
    asked: bool,
    heard: Instant,
}

impl Open {
    /// How many packets are missing between leader and trailer; fewer than none if some lie behind the trailer.
    fn missing(&self) -> Option<i64> {
        self.last.map(|last| i64::from(last) - 1 - self.pieces.len() as i64)
    }

    fn complete(&self) -> bool {
        self.leader.is_some() && self.missing() == Some(0)
    }

    /// The first and the last packet that are missing before the trailer.
    fn gap(&self) -> Option<[u32; 2]> {
        let last = self.last?;
        let numbers = self.pieces.keys().zip(1..last).take_while(|(is, due)| *is == due).count() as u32;
        let first = if self.leader.is_some() { numbers + 1 } else { 0 };
        let after = self.pieces.keys().rev().zip((1..last).rev()).take_while(|(is, due)| *is == due).count() as u32;
        (first < last).then(|| [first, (last - 1 - after).max(first)])
    }

    fn close(self) -> Block {
        let missing = match (&self.leader, self.last) {
            _ if self.fault.is_some() => self.fault,
            (None, _) => Some("its leader is missing".to_owned()),
            (_, None) => Some("its trailer is missing".to_owned()),
            (_, Some(last)) if self.missing() != Some(0) => {
                Some(format!("{} of {} packets are missing", self.missing().unwrap_or(0), last - 1))
            }
            _ => None,
        };
        if let Some(why) = missing {
            return Block::Broken(self.id, why);
        }
        let (ticks, announced) = self.leader.expect("seen above");
        match joined(announced, self.pieces.into_values().collect()) {
            Ok(parts) => Block::Whole(self.id, ticks, parts),
            Err(why) => Block::Broken(self.id, why),
        }
    }
}

/// The parts with their bytes. A place counts from the beginning of the part or of the payload; only one of them tiles
/// the part without a gap.
fn joined(announced: Vec<Announced>, mut pieces: Vec<Piece>) -> Result<Vec<Part>, String> {
    pieces.sort_by_key(|(part, at, _)| (*part, *at));
    let mut pieces = pieces.into_iter().peekable();
    let (mut parts, mut before) = (Vec::new(), 0);
    for (i, Announced { mut part, length }) in announced.into_iter().enumerate() {
        let begins = pieces.peek().filter(|(of, ..)| usize::from(*of) == i).map_or(0, |(_, at, _)| *at);
        if begins != 0 && begins != before {
            return Err(format!("part {i} begins at byte {begins}, not at 0 or {before}"));
        }
        while let Some((_, at, bytes)) = pieces.next_if(|(of, ..)| usize::from(*of) == i) {
            if at != begins + part.bytes.len() as u64 {
                return Err(format!("part {i} has a gap or an overlap at byte {at}"));
            }
            part.bytes.extend(bytes);
        }
        if part.bytes.len() as u64 != length {
            return Err(format!("part {i} has {} bytes, its leader announces {length}", part.bytes.len()));
        }
        before += length;
        parts.push(part);
    }
    match pieces.next() {
        Some((of, ..)) => Err(format!("a packet belongs to part {of}, the leader announces {}", parts.len())),
        None => Ok(parts),
    }
}

/// Packets that a camera is to send again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Again {
    /// Number of the block.
    pub block: u64,
    /// The first and the last of the packets.
    pub packets: [u32; 2],
    /// Whether numbers have 64 and 32 bits.
    pub extended: bool,
}

/// Blocks that are being assembled from packets.
#[derive(Default)]
pub struct Blocks {
    open: VecDeque<Open>,
    /// Numbers of the last blocks that were closed: their packets arrive too late.
    closed: VecDeque<u64>,
    done: VecDeque<Block>,
    /// Packets that were lost and not yet asked for.
    pub lost: VecDeque<Again>,
    /// Packets that came when they were asked for.
    pub resent: u64,
    /// Number of packets of other payload types.
    pub foreign: u64,
}

impl Blocks {
    /// Takes a packet that arrived now. Packets that are no GVSP are skipped: anybody can send one.
    pub fn take(&mut self, datagram: &[u8], now: Instant) {
        let Ok(header) = parse_header(datagram) else { return };
        let body = &datagram[header.header_len..];
        let kind = datagram[4] & 0x0f;
        let number = |at: usize| body.get(at..at + 2).map(|b| u16::from_be_bytes([b[0], b[1]]));
        if !matches!(kind, LEADER | TRAILER | PART_DATA) || kind != PART_DATA && number(2) != Some(MULTI_PART) {
            self.foreign += 1;
            return;
        }
        if self.closed.contains(&header.block_id) {
            return;
        }
        let Some(open) = self.of(header.block_id, now) else { return };
        open.heard = now;
        // A packet that is sent again says so with a status that is no error.
        if header.status & 0x8000 != 0 {
            open.fault = Some(format!("the camera states the error {:#06x}", header.status));
        }
        match kind {
            // The number of parts stands where the packet's number would.
            LEADER => match leader(body, usize::from(datagram[7])) {
                Ok(read) => open.leader = Some(read),
                Err(why) => open.fault = Some(why),
            },
            TRAILER => open.last = Some(header.packet_id.max(1)),
            _ => {
                if let Some((part, at, bytes)) = piece(body) {
                    open.bytes += bytes.len() as u64 + OVERHEAD;
                    if open.bytes > LARGEST + LARGEST / 8 {
                        (open.fault, open.pieces) = (Some(format!("is larger than {LARGEST} bytes")), BTreeMap::new());
                    } else if open.fault.is_none() {
                        open.pieces.insert(header.packet_id, (part, at, bytes));
                    }
                }
            }
        }
        let again = open.asked && kind != TRAILER;
        if open.complete() {
            self.close(header.block_id);
        } else if kind == TRAILER && !open.asked && open.fault.is_none() {
            open.asked = true;
            let again = |packets| Again { block: header.block_id, packets, extended: header.extended_ids };
            let gap = open.gap().map(again);
            self.lost.extend(gap);
        }
        self.resent += u64::from(again);
    }

    /// Closes blocks that waited too long, and returns the next one that ended.
    pub fn ended(&mut self, now: Instant) -> Option<Block> {
        while let Some(late) = self.open.iter().find(|o| now.saturating_duration_since(o.heard) > OVERDUE) {
            self.close(late.id);
        }
        self.done.pop_front()
    }

    fn of(&mut self, id: u64, now: Instant) -> Option<&mut Open> {
        if let Some(i) = self.open.iter().position(|o| o.id == id) {
            return self.open.get_mut(i);
        }
        if self.open.len() == OPEN {
            let oldest = self.open.front()?.id;
            self.close(oldest);
        }
        let (leader, pieces, last, fault) = (None, BTreeMap::new(), None, None);
        self.open.push_back(Open { id, leader, pieces, bytes: 0, last, fault, asked: false, heard: now });
        self.open.back_mut()
    }

    fn close(&mut self, id: u64) {
        if let Some(open) = self.open.iter().position(|o| o.id == id).and_then(|i| self.open.remove(i)) {
            self.closed.truncate(LATE - 1);
            self.closed.push_front(id);
            self.done.push_back(open.close());
        }
    }
}

/// The time in ticks and the parts that a leader announces.
fn leader(body: &[u8], parts: usize) -> Result<(u64, Vec<Announced>), String> {
    let word = |at: usize| body.get(at..at + 4).map(|b| u32::from_be_bytes([b[0], b[1], b[2], b[3]]));
    let half = |at: usize| body.get(at..at + 2).map(|b| u16::from_be_bytes([b[0], b[1]]));
    let long = |high: u32, low: u32| u64::from(high) << 32 | u64::from(low);
    let one = |i: usize| {
        let at = BEFORE_PARTS + PART * i;
        let part = Part {
            code: word(at + 8)?,
            size: [word(at + 24)?, word(at + 28)?],
            padding: half(at + 40)?,
            bytes: Vec::new(),
        };
        word(at + PART - 4)?;
        Some(Announced { part, length: long(half(at + 2)?.into(), word(at + 4)?) })
    };
    let ticks = word(4).zip(word(8)).map(|(high, low)| long(high, low));
    let announced: Option<Vec<Announced>> = (0..parts).map(one).collect();
    let (Some(ticks), Some(announced)) = (ticks, announced.filter(|all| !all.is_empty())) else {
        return Err(format!("its leader of {} bytes is too short for {parts} parts", body.len()));
    };
    let all = announced.iter().fold(0u64, |sum, a| sum.saturating_add(a.length));
    if all > LARGEST {
        return Err(format!("its leader announces {all} bytes, {LARGEST} is the limit"));
    }
    Ok((ticks, announced))
}

fn piece(body: &[u8]) -> Option<Piece> {
    let data = body.get(BEFORE_DATA..)?;
    let at = body[2..BEFORE_DATA].iter().fold(0, |at, b| at << 8 | u64::from(*b));
    Some((body[0], at, data.to_vec()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn packet(kind: u8, block: u16, number: u32, body: &[u8]) -> Vec<u8> {
        let [_, a, b, c] = number.to_be_bytes();
        [&[0, 0], &block.to_be_bytes()[..], &[kind, a, b, c], body].concat()
    }

    /// A block of heights of 3x2, 16 bits, and of light of 3x2, 8 bits, in packets of 5 bytes. Places count from the
    /// beginning of the part, or of the payload.
    fn block(id: u16, of_payload: bool) -> Vec<Vec<u8>> {
        let parts: [(u16, u32, Vec<u8>); 2] =
            [(5, 0x0110_00b8, (0..12).collect()), (1, 0x0108_0001, (50..56).collect())];
        let mut leader = [&[0, 0, 0, 10][..], &0x1_0000_0002u64.to_be_bytes()].concat();
        for (kind, code, bytes) in &parts {
            let (length, size) = (bytes.len() as u32, [3u32, 2]);
            leader.extend([&kind.to_be_bytes()[..], &[0, 0], &length.to_be_bytes(), &code.to_be_bytes()].concat());
            leader.extend([0, 0, 7, 0, 0, 0, 0, 0, 0, 4, 0, 0]);
            size.iter().for_each(|s| leader.extend(s.to_be_bytes()));
            leader.extend([0; 8]);
            leader.extend([0, 9, 0, 0, 0, 0, 0, 0]);
        }
        let mut all = vec![packet(LEADER, id, 2, &leader)];
        let mut before = 0;
        for (i, (_, _, bytes)) in parts.iter().enumerate() {
            for (k, five) in bytes.chunks(5).enumerate() {
                let at = (5 * k + if of_payload { before } else { 0 }) as u32;
                let body = [&[i as u8, 0, 0, 0][..], &at.to_be_bytes(), five].concat();
                all.push(packet(PART_DATA, id, all.len() as u32, &body));
            }
            before += bytes.len();
        }
        all.push(packet(TRAILER, id, all.len() as u32, &[0, 0, 0, 10, 0, 0, 0, 2]));
        all
    }

    fn whole(id: u64) -> Block {
        let part = |code, bytes: std::ops::Range<u8>| Part { code, size: [3, 2], padding: 9, bytes: bytes.collect() };
        Block::Whole(id, 0x1_0000_0002, vec![part(0x0110_00b8, 0..12), part(0x0108_0001, 50..56)])
    }

    fn all_of(blocks: &mut Blocks, at: Instant) -> Vec<Block> {
        std::iter::from_fn(|| blocks.ended(at)).collect()
    }

    #[test]
    fn parts_are_joined_in_any_order_of_packets_and_from_either_beginning() {
        let now = Instant::now();
        for of_payload in [false, true] {
            let mut blocks = Blocks::default();
            block(1, of_payload).iter().for_each(|p| blocks.take(p, now));
            // Backwards, one packet twice, and between those of the next block.
            let (mut two, three) = (block(2, of_payload), block(3, of_payload));
            two.reverse();
            two.push(two[2].clone());
            two.iter().zip(&three).for_each(|(a, b)| [a, b].iter().for_each(|p| blocks.take(p, now)));
            assert_eq!(all_of(&mut blocks, now), [whole(1), whole(2), whole(3)]);
            assert_eq!(blocks.foreign, 0);
        }
    }

    #[test]
    fn a_block_without_all_of_its_packets_is_never_whole() {
        let now = Instant::now();
        let later = now + 2 * OVERDUE;
        let packets = block(7, false);
        for lost in 0..packets.len() {
            let mut blocks = Blocks::default();
            packets.iter().enumerate().filter(|(i, _)| *i != lost).for_each(|(_, p)| blocks.take(p, now));
            assert_eq!(all_of(&mut blocks, now), [], "it may still come");
            let all = all_of(&mut blocks, later);
            assert!(matches!(&all[..], [Block::Broken(7, why)] if why.contains("missing")), "{lost}: {all:?}");
            let gap = if lost + 1 < packets.len() {
                vec![Again { block: 7, packets: [lost as u32; 2], extended: false }]
            } else {
                vec![]
            };
            assert_eq!(Vec::from(blocks.lost.clone()), gap);
            // Too late.
            blocks.take(&packets[lost], later);
            assert_eq!(all_of(&mut blocks, later + 2 * OVERDUE), [], "{lost}");
        }
        // Asked for and sent again.
        let mut blocks = Blocks::default();
        [0, 2, 6].iter().for_each(|i| blocks.take(&packets[*i], now));
        assert_eq!(blocks.lost.pop_front().unwrap().packets, [1, 5]);
        packets[1..6].iter().for_each(|p| blocks.take(p, now));
        assert_eq!((all_of(&mut blocks, now), blocks.resent), (vec![whole(7)], 5));
        // The same packet again, after the next block: the first one stays closed.
        block(8, false).iter().chain(&packets[1..2]).for_each(|p| blocks.take(p, now));
        assert_eq!((all_of(&mut blocks, later), blocks.open.len()), (vec![whole(8)], 0));
        // A fifth block ends the wait for the first.
        let mut blocks = Blocks::default();
        (1..=5).for_each(|id| blocks.take(&block(id, false)[0], now));
        assert!(matches!(&all_of(&mut blocks, now)[..], [Block::Broken(1, _)]));
    }

    #[test]
    fn packets_that_contradict_the_leader_are_named() {
        let now = Instant::now();
        let said = |change: &dyn Fn(&mut Vec<Vec<u8>>)| {
            let mut packets = block(1, false);
            change(&mut packets);
            let mut blocks = Blocks::default();
            packets.iter().for_each(|p| blocks.take(p, now));
            match all_of(&mut blocks, now + 2 * OVERDUE).remove(0) {
                Block::Broken(1, why) => why,
                other => panic!("{other:?}"),
            }
        };
        assert!(said(&|p| p[0][7] = 3).contains("too short for 3 parts"));
        assert!(said(&|p| p[0][7] = 1).contains("belongs to part 1, the leader announces 1"));
        assert!(said(&|p| p[2][15] = 4).contains("gap or an overlap at byte 4"));
        assert!(said(&|p| p[4][15] = 3).contains("part 1 begins at byte 3"));
        let shorter = said(&|p| {
            p[3].pop();
        });
        assert!(shorter.contains("part 0 has 11 bytes, its leader announces 12"));
        assert!(said(&|p| p[1][0] = 0x80).contains("error 0x8000"));
        assert!(said(&|p| p[0][8 + BEFORE_PARTS + 4] = 0xff).contains("is the limit"));
        let mut blocks = Blocks::default();
        blocks.take(&packet(LEADER, 1, 0, &[0, 0, 0, 1, 0, 0, 0, 0]), now);
        blocks.take(&packet(8, 1, 1, &[0; 16]), now);
        blocks.take(&[1, 2, 3], now);
        assert_eq!((blocks.foreign, blocks.open.len()), (2, 0));
    }

    #[test]
    fn changed_packets_never_panic_and_hold_little_memory() {
        let rounds = if std::env::var_os("SHEETLIGHT_LONG").is_some() { 1_000_000 } else { 100_000 };
        let (mut dice, mut blocks, mut wholes) = (1u64, Blocks::default(), 0);
        let mut roll = |most: usize| {
            dice = dice.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (dice >> 33) as usize % most
        };
        let mut now = Instant::now();
        for round in 0..rounds {
            let packets = block(round as u16 / 7, round % 2 == 0);
            let mut packet = packets[roll(packets.len())].clone();
            for _ in 0..roll(4) {
                let at = roll(packet.len());
                packet[at] = roll(256) as u8;
            }
            packet.truncate(packet.len() - if roll(10) == 0 { roll(packet.len()) } else { 0 });
            now += Duration::from_millis(roll(3) as u64);
            blocks.take(&packet, now);
            wholes += all_of(&mut blocks, now).iter().filter(|b| matches!(b, Block::Whole(..))).count();
            assert!(blocks.open.len() <= OPEN && blocks.open.iter().all(|o| o.pieces.len() < 4096), "round {round}");
        }
        println!("{rounds} packets, {wholes} whole blocks");
    }
}
