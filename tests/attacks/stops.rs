//! In: every command that writes, killed, or its disk full, at each of its file operations. Out: its result is the
//! former one or the new one, whole, and what stands beside it belongs to it; run again, it ends as if nothing had
//! been.
//! Frame and unit: none. SHEETLIGHT_LONG tries every operation of all commands; else those of the quick ones.

use super::bench::{run, snapshot};
use super::crashes::{cut_off, long};
use sheetlight::find::{LocateOptions, Recipe};
use sheetlight::geometry::Vec3;
use sheetlight::scan::HeightMap;
use sheetlight::station::find_part;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// What commands read: a former input and a new one of each kind.
fn inputs() -> &'static Path {
    static MADE: OnceLock<tempfile::TempDir> = OnceLock::new();
    MADE.get_or_init(|| {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name).to_str().unwrap().to_owned();
        for (n, diameter) in [(0, 8), (1, 9)] {
            let frame = "0\nLWPOLYLINE\n90\n4\n70\n1\n10\n0\n20\n0\n10\n40\n20\n0\n10\n40\n20\n30\n10\n0\n20\n30\n";
            let hole = format!("0\nCIRCLE\n10\n20\n20\n15\n40\n{diameter}\n");
            let text = format!(
                "0\nSECTION\n2\nHEADER\n9\n$INSUNITS\n70\n4\n0\nENDSEC\n0\nSECTION\n2\nENTITIES\n{frame}{hole}0\n\
                ENDSEC\n0\nEOF\n"
            );
            std::fs::write(at(&format!("{n}.dxf")), text).unwrap();
            let seed = n.to_string();
            let mut simulate =
                vec!["simulate".to_owned(), "--out".into(), at(&format!("sim{n}")), "--seed".into(), seed];
            simulate.extend(["--width", "320", "--quiet", "--set", "scan"].map(str::to_owned));
            let rig = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/..")).join("data/rigs/paper.toml");
            simulate.extend(["--rig".to_owned(), rig.to_str().unwrap().into()]);
            run(&simulate);
            let mut scan =
                vec!["scan".to_owned(), at(&format!("sim{n}/scan")), "--out".into(), at(&format!("scan{n}"))];
            scan.extend(["--station".to_owned(), at(&format!("sim{n}/station"))]);
            scan.extend(["--quiet", "--on", "cpu", "--overlays", "0"].map(str::to_owned));
            run(&scan);
            if long() {
                let sets = ["intrinsics", "handeye", "laserplane", "pointer_cal"];
                let mut simulate = ["simulate", "--out", &at(&format!("cal{n}")), "--seed", &n.to_string()]
                    .map(str::to_owned)
                    .to_vec();
                simulate.extend(["--width", "320", "--quiet"].map(str::to_owned));
                simulate.extend(sets.iter().flat_map(|s| ["--set".to_owned(), (*s).to_owned()]));
                run(&simulate);
                let axis = ["simulate", "--motion", "linear", "--set", "axis", "--width", "320", "--quiet"];
                let axis = axis.into_iter().chain(["--rig", rig.to_str().unwrap()]).map(str::to_owned);
                let own = ["--out".to_owned(), at(&format!("axis{n}")), "--seed".into(), n.to_string()];
                run(&axis.chain(own).collect::<Vec<_>>());
            }
        }
        dir
    })
    .path()
}

/// A command under attack.
struct Stopped {
    /// Its words; `{n}` is the number of the input, `{in}` the folder of all inputs, `{work}` the folder it writes
    /// into.
    words: String,
    /// The file that counts, in `{work}`, and those that are shown beside it.
    result: &'static str,
    /// What is in `{work}` beforehand, from the inputs.
    before: Option<&'static str>,
    /// Of its file operations every so many are tried.
    every: u64,
    /// Its files take their names together, and whoever reads them next ends what was begun.
    read_first: bool,
}

impl Stopped {
    fn args(&self, work: &Path, n: usize) -> Vec<String> {
        let (inputs, work, n) = (inputs().to_str().unwrap(), work.to_str().unwrap(), n.to_string());
        let fill = |w: &str| w.replace("{in}", inputs).replace("{work}", work).replace("{n}", &n);
        self.words.split_whitespace().map(fill).chain(["--quiet".to_owned()]).collect()
    }

    /// `{work}` as it was before anything was run.
    fn prepare(&self, work: &Path) {
        let _ = std::fs::remove_dir_all(work);
        std::fs::create_dir_all(work).unwrap();
        if let Some(from) = self.before {
            restore(work, &snapshot(&inputs().join(from)));
        }
    }

    /// Tries every moment, killed and full, over a former result and where there is none.
    fn attack(&self) {
        let dir = tempfile::tempdir().unwrap();
        let work = dir.path().join("work");
        let mut tried = [0, 0];
        for former in [true, false] {
            self.prepare(&work);
            if former {
                run(&self.args(&work, 0));
            }
            let before = snapshot(&work);
            run(&self.args(&work, 1));
            let (old, new) = (content(&before), content(&snapshot(&work)));
            let result = PathBuf::from(self.result);
            assert!(new.contains_key(&result) && old.get(&result) != new.get(&result), "{}", self.words);
            for variable in ["SHEETLIGHT_DIE_AT", "SHEETLIGHT_FULL_AT"] {
                for at in (1..).step_by(self.every as usize) {
                    restore(&work, &before);
                    let done = cut_off(&self.args(&work, 1), variable, at);
                    if self.read_first {
                        read(&work);
                    }
                    let place = format!("{} {variable}={at}, former {former}", self.words);
                    let found = snapshot(&work);
                    self.judge(&place, done, &found, &old, &new);
                    tried[usize::from(variable == "SHEETLIGHT_FULL_AT")] += 1;
                    if done {
                        break;
                    }
                    run(&self.args(&work, 1));
                    let again = content(&snapshot(&work));
                    // A joint calibration begins at the records that are there: from the new ones it comes to other
                    // last digits.
                    let begun_anew = self.read_first && content(&found).get(&result) == new.get(&result);
                    let wrong: Vec<_> = new.keys().filter(|f| is_kept(f) && again.get(*f) != new.get(*f)).collect();
                    let wrong = if begun_anew { vec![] } else { wrong };
                    assert!(wrong.is_empty(), "{place}: run again, {wrong:?} are others");
                    // Who was killed leaves a temporary file, and who writes there next takes it away.
                    let left: Vec<_> = again.keys().filter(|f| is_temporary(f)).collect();
                    assert!(left.is_empty(), "{place}: run again, {left:?} are left");
                }
            }
        }
        println!("{:60} {} kills, {} full disks", self.words, tried[0], tried[1]);
        assert!(tried.iter().all(|n| *n >= 4), "{}: {tried:?} moments", self.words);
    }

    fn judge(&self, place: &str, done: bool, found: &Content, old: &Content, new: &Content) {
        let found = &content(found);
        let result = Path::new(self.result);
        let is_new = found.get(result).is_some_and(|r| Some(r) == new.get(result));
        assert!(is_new || !done, "{place}: done, and {} is not the new one", self.result);
        assert!(is_new || found.get(result) == old.get(result), "{place}: {} is neither old nor new", self.result);
        for (file, bytes) in found.iter().filter(|(f, _)| is_kept(f)) {
            let belongs = if is_new { new } else { old };
            // What neither changes is there before and after.
            assert!(belongs.get(file) == Some(bytes), "{place}: {} does not belong to {}", file.display(), self.result);
        }
        // A picture that is shown beside the result may be gone, also where both look alike.
        let is_shown = |f: &Path| f != result && f.file_stem() == result.file_stem();
        for file in old.keys().filter(|f| is_kept(f) && !is_shown(f) && old.get(*f) == new.get(*f)) {
            assert!(found.contains_key(file), "{place}: {} is lost", file.display());
        }
        let left = found.keys().find(|f| !is_kept(f) && !f.to_string_lossy().contains("previous"));
        assert!(place.contains("DIE") || left.is_none(), "{place}: {left:?} is left");
    }
}

type Content = BTreeMap<PathBuf, Vec<u8>>;

fn is_temporary(file: &Path) -> bool {
    let made_aside = file.components().any(|c| c.as_os_str().to_string_lossy().ends_with(".part"));
    made_aside || file.file_name().is_some_and(|n| n.to_string_lossy().starts_with(".sheetlight."))
}

/// Neither temporary nor a former calibration, of which two may be there.
fn is_kept(file: &Path) -> bool {
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    !is_temporary(file) && !name.contains("previous")
}

/// Files without what the clock puts into them.
fn content(files: &Content) -> Content {
    let timed = |line: &&str| ["\"created\"", "\"seal\"", "seconds"].iter().any(|w| line.contains(w));
    let plain = |bytes: &Vec<u8>| match std::str::from_utf8(bytes) {
        Ok(text) => text.lines().filter(|l| !timed(l)).collect::<Vec<_>>().join("\n").into_bytes(),
        Err(_) => bytes.clone(),
    };
    files.iter().map(|(name, bytes)| (name.clone(), plain(bytes))).collect()
}

fn restore(work: &Path, files: &Content) {
    let _ = std::fs::remove_dir_all(work);
    std::fs::create_dir_all(work).unwrap();
    for (name, bytes) in files {
        let path = work.join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, bytes).unwrap();
    }
}

fn read(station: &Path) {
    if let Err(fault) = sheetlight::rig::Rig::load(station).and_then(|rig| rig.belong_together()) {
        panic!("{fault}");
    }
}

fn command(words: impl Into<String>, result: &'static str) -> Stopped {
    Stopped { words: words.into(), result, before: None, every: 1, read_first: false }
}

#[test]
#[cfg_attr(not(debug_assertions), ignore = "only debug builds can be stopped at a file operation")]
fn quick_commands() {
    for c in [
        command("station export --station {in}/sim{n}/station --out {work}/values.json", "values.json"),
        command("board chessboard 9x6 --square-mm 1{n} --out {work}/board", "board.json"),
        command("model {in}/{n}.dxf --name part --out {work}/part.toml", "part.toml"),
    ] {
        c.attack();
    }
    Stopped {
        before: Some("sim1/station"),
        ..command(
            "station seal --station {work} --kind laser-plane --because reason{n}",
            "calibration/laser_plane.json",
        )
    }
    .attack();
}

#[test]
#[cfg_attr(not(debug_assertions), ignore = "only debug builds can be stopped at a file operation")]
fn finding() {
    let every = if long() { 1 } else { 5 };
    Stopped {
        every,
        ..command(
            "find {in}/scan{n} --recipe {in}/sim{n}/notched.toml --station {in}/sim{n}/station --out {work}/pose.json",
            "pose.json",
        )
    }
    .attack();
    if !long() {
        println!("SKIPPED: second-look, teach; set SHEETLIGHT_LONG");
        return;
    }
    for c in [
        command(
            "second-look {in}/scan{n} --recording {in}/sim{n}/scan --recipe {in}/sim{n}/notched.toml --station \
             {in}/sim{n}/station --out {work}/second.json",
            "second.json",
        ),
        command(format!("teach {{in}}/scan0 --name p{{n}} {} --out {{work}}/taught.toml", outline()), "taught.toml"),
    ] {
        c.attack();
    }
}

/// What a person would drag around the plate in the height map of the first scan.
fn outline() -> String {
    let (scan, sim) = (inputs().join("scan0"), inputs().join("sim0"));
    let recipe = Recipe::load(&sim.join("notched.toml")).unwrap();
    let found = find_part(&scan, &recipe, Some(&sim.join("station")), &LocateOptions::default()).unwrap().0;
    let map = HeightMap::load(&scan).unwrap();
    let (base_from_part, grid_from_base) = (found.base_from_part, map.base_from_grid.inverse());
    let (at, along) = (
        grid_from_base.point(&base_from_part.translation),
        grid_from_base.direction(&base_from_part.direction(&Vec3::x())),
    );
    let (x, y, turn) = (at.x, at.y, along.y.atan2(along.x).to_degrees());
    format!("--outline {:.1},{:.1},{:.1},{:.1} --angle-deg {turn:.1}", x - 18.0, y - 12.0, x + 18.0, y + 12.0)
}

#[test]
fn calibrating() {
    if !long() {
        println!("SKIPPED: calibrating some hundred times takes minutes; set SHEETLIGHT_LONG");
        return;
    }
    let calibration = |words: &str, result| Stopped { before: Some("cal0/station"), ..command(words, result) };
    for c in [
        calibration("calibrate laser-plane {in}/cal{n}/laserplane --station {work}", "calibration/laser_plane.json"),
        calibration("calibrate pointer {in}/cal{n}/pointer_cal --station {work}", "calibration/pointer.json"),
        calibration(
            "calibrate hand-eye {in}/cal{n}/handeye --poses poses_noisy --station {work} --keep-badly-determined",
            "calibration/hand_eye.json",
        ),
        // Some seconds each.
        Stopped {
            every: 3,
            ..calibration("calibrate camera {in}/cal{n}/intrinsics --station {work}", "calibration/camera.json")
        },
        Stopped {
            before: Some("axis0/station"),
            ..command("calibrate axis {in}/axis{n}/axis --station {work}", "calibration/linear_axis.json")
        },
        // Half a minute each.
        Stopped {
            every: 7,
            read_first: true,
            ..calibration(
                "calibrate joint {in}/cal{n}/handeye {in}/cal{n}/laserplane {in}/cal{n}/pointer_cal --poses \
                 poses_noisy \
                 --station {work} --on cpu --keep-badly-determined",
                "calibration/joint.json",
            )
        },
    ] {
        c.attack();
    }
}
