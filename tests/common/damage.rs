//! In: valid bytes of a format, its reader. Out: a failure where damaged ones make it panic, hang, eat memory, or
//! fault without a next step; what failed is kept, and read first the next time (tests/corpus).
//! Frame and unit: s, MiB.

#[path = "process.rs"]
mod process;

use process::{most_held_mb, processor_seconds};
use rand::seq::IndexedRandom;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;
use sheetlight::fault::Fault;
use sheetlight::rig::sealed;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::mpsc::channel;
use std::time::Duration;

/// What damaged numbers become: where limits are forgotten.
const NUMBERS: [&str; 20] = [
    "0",
    "-0",
    "-1",
    "1",
    "65536",
    "4294967295",
    "4294967296",
    "9223372036854775808",
    "18446744073709551615",
    "1e5",
    "1e10",
    "1e30",
    "1e160",
    "1e308",
    "1e-308",
    "-1e308",
    "nan",
    "inf",
    "99999999",
    "0.000000001",
];

/// One to five edits: bytes cut, changed, doubled, put in; numbers made extreme; lines gone, doubled or from another
/// file.
fn damaged(seeds: &[Vec<u8>], rng: &mut Pcg64) -> Vec<u8> {
    let mut bytes = seeds.choose(rng).expect("a seed").clone();
    for _ in 0..rng.random_range(1..6) {
        let at = rng.random_range(0..=bytes.len());
        match rng.random_range(0..9) {
            0 if rng.random_bool(0.3) => bytes.truncate(at),
            1 if at < bytes.len() => bytes[at] = rng.random(),
            2 => bytes.insert(at, rng.random()),
            3 if bytes.len() < 1 << 16 => bytes.extend_from_within(at..),
            4..7 => {
                // The number at or behind the place.
                let digit = |b: &u8| b.is_ascii_digit();
                let Some(from) = bytes[at..].iter().position(digit).map(|i| at + i) else { continue };
                let end = bytes[from..]
                    .iter()
                    .position(|b| !b.is_ascii_digit() && *b != b'.')
                    .map_or(bytes.len(), |i| from + i);
                bytes.splice(from..end, NUMBERS.choose(rng).expect("numbers").bytes());
            }
            7 => {
                let begin = bytes[..at].iter().rposition(|b| *b == b'\n').map_or(0, |i| i + 1);
                let end = bytes[at..].iter().position(|b| *b == b'\n').map_or(bytes.len(), |i| at + i + 1);
                let line = bytes[begin..end].to_vec();
                if rng.random_bool(0.5) {
                    bytes.drain(begin..end).for_each(drop)
                } else {
                    bytes.splice(end..end, line).for_each(drop)
                }
            }
            _ => {
                let other = seeds.choose(rng).expect("a seed");
                let (a, b) = (rng.random_range(0..=other.len()), rng.random_range(0..=other.len()));
                bytes.splice(at..at, other[a.min(b)..a.max(b)].iter().copied()).for_each(drop);
            }
        }
    }
    bytes
}

/// No answer after this much processor time: too long; after this much on the clock: a hang.
const MOST_SECONDS: f64 = 5.0;
const HANGS: Duration = Duration::from_secs(120);
/// Memory that the whole process may ever have held.
const MOST_MB: u64 = 512;

/// Where what once failed is kept, a folder a parser; and where what fails now is put, to be moved there.
const CORPUS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/corpus");
const FAILED: &str = concat!(env!("CARGO_TARGET_TMPDIR"), "/fuzz");

/// What once failed of a parser.
fn corpus(name: &str) -> Vec<Vec<u8>> {
    let files = std::fs::read_dir(Path::new(CORPUS).join(name)).into_iter().flatten();
    let mut files: Vec<PathBuf> = files.map(|e| e.unwrap().path()).collect();
    files.sort();
    files.iter().map(|f| std::fs::read(f).unwrap()).collect()
}

/// Keeps a file that failed, or may; the next one takes its place.
fn keep(name: &str, bytes: &[u8]) -> PathBuf {
    let path = Path::new(FAILED).join(name);
    std::fs::create_dir_all(FAILED).expect("the target's folder");
    std::fs::write(&path, bytes).expect("a file");
    path
}

/// Mutations of each parser in the long form: those of a number that SHEETLIGHT_LONG gives, else 100,000.
fn rounds() -> usize {
    let long = std::env::var("SHEETLIGHT_LONG").ok();
    long.map_or(300, |n| n.parse().ok().filter(|n| *n > 1).unwrap_or(100_000))
}

/// Lets a parser read what once failed, and so many damaged files.
pub fn survives(name: &'static str, seeds: Vec<Vec<u8>>, read: impl Fn(&[u8]) -> Result<(), Fault> + Send + 'static) {
    let rounds = rounds();
    let (tell, told) = channel();
    std::thread::spawn(move || {
        for seed in &seeds {
            read(seed).unwrap_or_else(|e| {
                panic!("{name}: the undamaged file is not read: {e}\n{}", String::from_utf8_lossy(seed))
            });
        }
        let mut rng = Pcg64::seed_from_u64(name.bytes().map(u64::from).sum());
        let once = corpus(name);
        for round in 0..once.len() + rounds {
            let bytes = once.get(round).cloned().unwrap_or_else(|| damaged(&seeds, &mut rng));
            tell.send(Some((round, bytes.clone()))).expect("the test listens");
            let before = processor_seconds();
            let answer = catch_unwind(AssertUnwindSafe(|| read(&bytes)));
            let seconds = processor_seconds() - before;
            let shown = || {
                let text = String::from_utf8_lossy(&bytes[..bytes.len().min(4000)]);
                format!("{name}, mutation {round}, kept as {}:\n{text}", keep(name, &bytes).display())
            };
            match answer {
                Err(_) => panic!("a panic: {}", shown()),
                Ok(Err(e)) => assert!(!e.what.is_empty() && !e.next.is_empty(), "no next step: {e}\n{}", shown()),
                Ok(Ok(())) => {}
            }
            assert!(seconds < MOST_SECONDS, "{seconds:.1} s: {}", shown());
            assert!(most_held_mb() < MOST_MB, "{} MB: {}", most_held_mb(), shown());
        }
        tell.send(None).expect("the test listens");
    });
    let mut last = None;
    loop {
        match told.recv_timeout(HANGS) {
            Ok(Some(now)) => last = Some(now),
            Ok(None) => return println!("{name}: {rounds} mutations, most memory so far {} MB", most_held_mb()),
            // The thread has ended: it printed what happened.
            Err(std::sync::mpsc::RecvTimeoutError::Disconnected) => panic!("{name} failed, see above"),
            Err(_) => {
                let kept = last.map(|(round, bytes)| (round, keep(name, &bytes)));
                panic!("{name}: no answer after {} s, mutation {kept:?}", HANGS.as_secs())
            }
        }
    }
}

/// A folder for files by the hundred thousand: in memory, where the system has a place for that.
pub fn scratch() -> tempfile::TempDir {
    let memory = Path::new("/dev/shm");
    if memory.is_dir() { tempfile::tempdir_in(memory) } else { tempfile::tempdir() }.expect("a folder")
}

/// For parsers that want a file: the same file again and again.
pub fn through_file(
    name: &str,
    read: impl Fn(&Path) -> Result<(), Fault> + Send + 'static,
) -> impl Fn(&[u8]) -> Result<(), Fault> + Send + 'static {
    let dir = scratch();
    let name = name.to_owned();
    move |bytes| {
        let path = dir.path().join(&name);
        std::fs::write(&path, bytes).expect("a file");
        read(&path)
    }
}

/// What is still JSON gets the seal of what it holds now, or damage would never come behind the seal.
pub fn sealed_anew(bytes: &[u8]) -> Vec<u8> {
    match serde_json::from_slice::<serde_json::Value>(bytes) {
        Ok(serde_json::Value::Object(mut object)) => {
            object.remove("seal");
            sealed(&object).into_bytes()
        }
        _ => bytes.to_vec(),
    }
}

pub fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}
