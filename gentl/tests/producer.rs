//! The built library, used as other programs do: by harvesters with EMVA's GenApi (harvest.py), by a C program that
//! opens and closes everything and calls wrongly (consumer.c), and by that program under valgrind. Registers and the
//! list of devices are changed at random.
//!
//! SHEETLIGHT_LONG=1 runs 10,000 rounds instead of 300, and 20 under valgrind.

#![cfg(target_os = "linux")]

use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;
use sheetlight::recording::Recording;
use sheetlight::rig::Rig;
use sheetlight::scan::Where;
use sheetlight::simulate::{SimulateOptions, simulate};
use sheetlight::station::{ScanOptions, Settings, scan_recording};
use sheetlight_gentl as producer;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

/// A folder with a simulated recording, its scan, and a list of devices that shows all kinds of them.
struct Stage(PathBuf);

const LIST: &str = r#"
[[device]]
id = "board"
scan = "board"

[[device]]
id = "broken"
name = "a folder that is not there"
scan = "nowhere"

[[device]]
id = "line"
recording = "cell/scan"
station = "cell/station"
on = "cpu"
grid = { cell_mm = 1.5, cells = [130, 60], heights_mm = [-10.0, 40.0] }

[[device]]
id = "simulated"
simulated = { seed = 5, width = 320, shots = 30 }
on = "cpu"
grid = { cell_mm = 0.8, cells = [150, 120], heights_mm = [-10.0, 40.0] }

[[device]]
id = "folder"
folder = "watched"
grid = { cell_mm = 1.5, cells = [130, 60], heights_mm = [-10.0, 40.0] }
"#;

impl Stage {
    fn path(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }

    /// Made once for all tests, in place of that of the last run.
    fn get() -> &'static Stage {
        static STAGE: OnceLock<Stage> = OnceLock::new();
        STAGE.get_or_init(|| {
            let stage = Stage(Path::new(env!("CARGO_TARGET_TMPDIR")).join("gentl"));
            if stage.0.exists() {
                std::fs::remove_dir_all(&stage.0).unwrap();
            }
            let options = SimulateOptions { width: 320, height: 240, shots: 40, ..SimulateOptions::default() };
            let made = simulate(&stage.path("cell"), &options, &|_, _| {}).unwrap();
            Settings::default().store(&made.station).unwrap();
            let (rig, settings) = (Rig::load(&made.station).unwrap(), Settings::default());
            let recording = Recording::open(&made.recordings[0].1).unwrap();
            std::fs::create_dir_all(stage.path("watched")).unwrap();
            for name in ["board", "watched/old"] {
                let out = stage.path(name);
                let options = ScanOptions { place: Where::Cpu, ..ScanOptions::for_station(&settings, &rig, &out) };
                scan_recording(&recording, None, &rig, &options, |_, _| {}).unwrap();
            }
            std::fs::write(stage.path("list.toml"), LIST).unwrap();
            stage
        })
    }
}

fn long() -> bool {
    std::env::var_os("SHEETLIGHT_LONG").is_some()
}

/// Says aloud what is not tested; where tests may not be skipped, it fails.
fn skipped(what: &str) {
    assert!(std::env::var_os("CI").is_none(), "not tested: {what}");
    eprintln!("\n*** SKIPPED: {what} ***\n");
}

/// The library as cargo built it for this test, under the name by which programs look for it.
fn cti(folder: &Path) -> PathBuf {
    let deps = std::env::current_exe().unwrap().parent().unwrap().to_owned();
    let built = deps.join("libsheetlight_gentl.so");
    let cti = folder.join("sheetlight.cti");
    std::fs::copy(&built, &cti).unwrap_or_else(|e| panic!("{}: {e}", built.display()));
    cti
}

fn run(what: &str, command: &mut Command) -> String {
    let out = command.output().unwrap_or_else(|e| panic!("{what}: {e}"));
    let said = String::from_utf8_lossy(&out.stdout).into_owned() + &String::from_utf8_lossy(&out.stderr);
    assert!(out.status.success(), "{what}: {}\n{said}", out.status);
    said
}

#[test]
fn harvesters_reads_frames_that_equal_the_scans_files() {
    let tried = Command::new("python3").args(["-c", "import genicam.genapi, harvesters.core, numpy"]).output();
    if !tried.is_ok_and(|out| out.status.success()) {
        return skipped("harvesters and numpy are missing here: make python");
    }
    let (stage, folder) = (Stage::get(), tempfile::tempdir().unwrap());
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/harvest.py");
    let said = run(
        "harvest.py",
        Command::new("python3")
            .arg(script)
            .args([cti(folder.path()), stage.path("board"), "1000".into(), stage.path("watched")])
            .env("SHEETLIGHT_GENTL", stage.path("list.toml"))
            .env("PYTHONDONTWRITEBYTECODE", "1"),
    );
    println!("{said}");
    assert!(said.contains("all checks passed") && said.matches("ok    ").count() > 50, "{said}");
}

/// The C program, built; `None` where there is no compiler.
fn consumer(folder: &Path) -> Option<PathBuf> {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/consumer.c");
    let program = folder.join("consumer");
    let mut cc = Command::new("cc");
    cc.args(["-g", "-O1", "-Wall", "-Wextra", "-Werror", "-o"]).arg(&program).arg(source).args(["-ldl", "-lpthread"]);
    if Command::new("cc").arg("--version").output().is_err() {
        skipped("there is no C compiler here");
        return None;
    }
    run("cc", &mut cc);
    Some(program)
}

fn consume(program: &Path, folder: &Path, before: &[&str], what: &str, times: u32) {
    let stage = Stage::get();
    let mut words: Vec<String> = before.iter().map(|w| (*w).to_owned()).collect();
    words.push(program.display().to_string());
    let mut command = Command::new(&words[0]);
    command.args(&words[1..]).arg(cti(folder)).args([what, &times.to_string()]);
    println!("{}", run(what, command.env("SHEETLIGHT_GENTL", stage.path("list.toml"))));
}

#[test]
fn a_c_program_opens_and_closes_everything_without_growing() {
    let folder = tempfile::tempdir().unwrap();
    if let Some(program) = consumer(folder.path()) {
        consume(&program, folder.path(), &[], "rounds", if long() { 10_000 } else { 300 });
    }
}

#[test]
fn wrong_calls_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    if let Some(program) = consumer(folder.path()) {
        consume(&program, folder.path(), &[], "misuse", if long() { 200 } else { 5 });
    }
}

#[test]
fn valgrind_finds_no_fault_in_either() {
    if Command::new("valgrind").arg("--version").output().is_err() {
        return skipped("valgrind is missing here: make cameras");
    }
    let folder = tempfile::tempdir().unwrap();
    let Some(program) = consumer(folder.path()) else { return };
    // Memory that is still in use at the end is the pool of threads, the standard library's and the loader's.
    let valgrind = ["valgrind", "-q", "--error-exitcode=9", "--leak-check=full"];
    let only = ["--show-leak-kinds=definite", "--errors-for-leak-kinds=definite"];
    let valgrind = [&valgrind[..], &only].concat();
    let times = if long() { 20 } else { 1 };
    consume(&program, folder.path(), &valgrind, "misuse", times);
    consume(&program, folder.path(), &valgrind, "rounds", times);
}

fn done(code: i32) {
    assert_eq!(code, 0, "{}", last());
}

fn last() -> String {
    let (mut code, mut text, mut size) = (0, [0u8; 2048], 2048);
    // SAFETY: the pointers lead to as much memory as they say.
    unsafe { producer::GCGetLastError(&mut code, text.as_mut_ptr().cast(), &mut size) };
    format!("{code}: {}", String::from_utf8_lossy(&text[..size.min(2048)]))
}

/// 100,000 writes of numbers at and beside all registers of all modules. Whatever was accepted, the frame is one that
/// the device can give.
#[test]
fn random_writes_leave_a_device_that_works() {
    const INTERESTING: [i64; 14] = [0, 1, 2, 3, 4, 6, 53, 54, 117, 118, -1, i64::MIN, i64::MAX, 0x7ff0_0000_0000_0000];
    let formats = [0x0108_0001, 0x0110_0007, 0x0110_00B8, 0x0120_00BF, 0x0260_00C0, 0x0108_00C6, 0x0110_00C7];
    let stage = Stage::get();
    // SAFETY: no other thread of this test program reads the environment meanwhile: this is the only test that loads
    // the list in this process, and the others hand theirs to a child.
    unsafe { std::env::set_var(producer::config::VARIABLE, stage.path("list.toml")) };
    let mut handles = [0; 5];
    let [tl, interface, device, remote, stream] = &mut handles;
    let id = c"board";
    done(producer::GCInitLib());
    // SAFETY: the pointers lead to as much memory as they say.
    unsafe {
        done(producer::TLOpen(tl));
        done(producer::TLOpenInterface(*tl, c"sheetlight".as_ptr(), interface));
        done(producer::IFOpenDevice(*interface, id.as_ptr(), 3, device));
        done(producer::DevGetPort(*device, remote));
        done(producer::DevOpenDataStream(*device, c"stream0".as_ptr(), stream));
    }
    let mut rng = Pcg64::seed_from_u64(7);
    let mut accepted = 0;
    let [stop, locked] = ["AcquisitionStop", "TLParamsLocked"].map(|name| register(handles[3], name));
    for n in 0..100_000 {
        // A start or a lock, which come by chance too, would have everything refused from then on.
        if n % 20 == 0 {
            for (at, value) in [(stop, 1i64), (locked, 0)] {
                // SAFETY: `size` is the length of the bytes.
                done(unsafe { producer::GCWritePort(handles[3], at, value.to_le_bytes().as_ptr() as *mut _, &mut 8) });
            }
        }
        // Mostly the remote device, which has most registers.
        let port = if rng.random_bool(0.8) { handles[3] } else { handles[rng.random_range(0..5)] };
        let beside = if rng.random_bool(0.1) { rng.random_range(0..0x400) } else { 0 };
        let at: u64 = 0x1000 + 0x400 * rng.random_range(0..70) + beside;
        let value: i64 = match rng.random_range(0..6) {
            4 => rng.random_range(0..8),
            5 => rng.random_range(0..130),
            0 => rng.random(),
            1 => formats[rng.random_range(0..formats.len())],
            2 => (f64::from(rng.random_range(-10i16..2000)) / 7.0).to_bits() as i64,
            _ => INTERESTING[rng.random_range(0..INTERESTING.len())],
        };
        let bytes = value.to_le_bytes();
        let mut size = if rng.random_bool(0.05) { rng.random_range(0..8) } else { 8 };
        // SAFETY: `size` is at most the length of `bytes`.
        let code = unsafe { producer::GCWritePort(port, at, bytes.as_ptr() as *mut _, &mut size) };
        accepted += u32::from(code == 0);
        // -1001 is a fault of the producer.
        assert!(matches!(code, 0 | -1005 | -1014 | -1015 | -1019), "write {n} of {value} at {at:#x}: {}", last());
        if n % 100 == 0 {
            let mut payload = 0usize;
            let mut size = size_of::<usize>();
            let info = (&raw mut payload).cast();
            // SAFETY: the pointers lead to as much memory as they say.
            done(unsafe { producer::DSGetInfo(handles[4], 7, std::ptr::null_mut(), info, &mut size) });
            assert!((1..=12398 * 18).contains(&payload), "{payload} bytes after write {n}");
        }
    }
    assert!(accepted > 3000, "only {accepted} writes were accepted");
    println!("{accepted} of 100000 writes accepted");
    // Whatever is set now, a frame comes.
    let (mut buffer, mut event, mut data, mut size) = (0, 0, [0usize; 2], 16);
    // SAFETY: the pointers lead to as much memory as they say.
    unsafe {
        done(producer::DSAllocAndAnnounceBuffer(handles[4], 1 << 20, std::ptr::null_mut(), &mut buffer));
        done(producer::DSQueueBuffer(handles[4], buffer));
        done(producer::GCRegisterEvent(handles[4], 1, &mut event));
        done(producer::DSStartAcquisition(handles[4], 0, u64::MAX));
        let write = |name: &str| {
            let mut size = 8;
            producer::GCWritePort(
                handles[3],
                register(handles[3], name),
                1i64.to_le_bytes().as_ptr() as *mut _,
                &mut size,
            )
        };
        done(write("AcquisitionStart"));
        // Refused if the trigger is off.
        write("TriggerSoftware");
        done(producer::EventGetData(event, data.as_mut_ptr().cast(), &mut size, 20_000));
    }
    done(producer::GCCloseLib());
}

/// The address of a feature's register in a port's description.
fn register(port: usize, name: &str) -> u64 {
    let mut length = 0u64;
    let mut size = 8;
    // SAFETY: the pointers lead to as much memory as they say.
    let xml = unsafe {
        done(producer::GCGetPortURLInfo(port, 0, 8, std::ptr::null_mut(), (&raw mut length).cast(), &mut size));
        let mut xml = vec![0u8; length as usize];
        let mut size = xml.len();
        done(producer::GCReadPort(port, 0x1000_0000, xml.as_mut_ptr().cast(), &mut size));
        String::from_utf8(xml).unwrap()
    };
    let at = xml.split_once(&format!("Name=\"{name}_Reg\"><Address>0x")).unwrap().1;
    u64::from_str_radix(&at[..at.find('<').unwrap()], 16).unwrap()
}

/// 100,000 damaged lists: each is read or refused with words.
#[test]
fn damaged_lists_are_refused_with_words() {
    let mut rng = Pcg64::seed_from_u64(11);
    let (mut good, mut refused) = (0, 0);
    let pieces = ["[[device]]", "=", "\"", "-1", "1e999", "nan", "{", "}", "grid", "scan", "\u{0}", "é", "id", "\n"];
    for _ in 0..100_000 {
        let mut text: Vec<char> = LIST.chars().collect();
        for _ in 0..rng.random_range(1..4) {
            if text.is_empty() {
                break;
            }
            let at = rng.random_range(0..text.len());
            match rng.random_range(0..4) {
                0 => drop(text.remove(at)),
                1 => text[at] = char::from(rng.random_range(0u8..128)),
                2 => drop(text.splice(at..at, pieces[rng.random_range(0..pieces.len())].chars())),
                _ => text.truncate(at.max(1)),
            }
        }
        match producer::config::parse(&text.iter().collect::<String>(), Path::new("/x")) {
            Ok(list) => {
                good += 1;
                assert!(list.iter().all(|(d, _)| !d.id.is_empty()));
            }
            Err(fault) => {
                refused += 1;
                assert!(!fault.what.is_empty() && !fault.next.is_empty(), "{fault:?}");
            }
        }
    }
    println!("{good} lists read, {refused} refused");
    assert!(good > 1000 && refused > 1000, "{good} read, {refused} refused");
}

#[test]
fn a_list_says_what_is_wrong() {
    let says = |text: &str, words: &str| {
        let said = match producer::config::parse(text, Path::new("/x")) {
            Err(fault) => fault.to_string(),
            Ok(list) => list.into_iter().find_map(|(_, origin)| origin.err()).expect("a fault").to_string(),
        };
        assert!(said.contains(words), "{said}");
    };
    says("", "0 devices");
    says("[[device]]\nid = 'a'\nscam = 'x'", "scam");
    says("[[device]]\nid = 'a b'\nscan = 'x'", "letters, digits");
    says("[[device]]\nid = 'a'\nscan = 'x'\n[[device]]\nid = 'a'\nscan = 'y'", "twice");
    says("[[device]]\nid = 'a'", "not clear where");
    says("[[device]]\nid = 'a'\nscan = 'x'\nfolder = 'y'", "not clear where");
    says("[[device]]\nid = 'a'\nfolder = 'y'", "grid is missing");
    says("[[device]]\nid = 'a'\nrecording = 'y'", "not clear where");
    says("[[device]]\nid = 'a'\nscan = 'x'\non = 'moon'", "moon");
    let grid =
        |grid: &str, words: &str| says(&format!("[[device]]\nid = 'a'\nfolder = 'y'\ngrid = {{ {grid} }}"), words);
    grid("cell_mm = 0.0, cells = [2, 2], heights_mm = [0, 1]", "grid.cell_mm is 0");
    grid("cell_mm = 1.0, cells = [0, 2], heights_mm = [0, 1]", "0 x 2");
    grid("cell_mm = 1.0, cells = [100000, 100000], heights_mm = [0, 1]", "100000 x 100000");
    grid("cell_mm = 1.0, cells = [2, 2], heights_mm = [3, 1]", "low, then high");
    grid("cell_mm = 1.0, cells = [2, 2], heights_mm = [nan, 1]", "low, then high");
}
