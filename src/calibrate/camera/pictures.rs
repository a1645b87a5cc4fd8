//! In: recordings of boards by one camera. Out: the boards' corners, picture by picture; why the other pictures have
//! none; the hashes of the input files.
//! Frame and unit: px.

use super::intrinsics::Observation;
use crate::calibrate::boards::{FindOptions, WRONG_SIZE, find, look_at_all};
use crate::fault::{Fault, Kind, Result};
use crate::recording::{BoardSpec, FrameRef, Recording};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::sync::Arc;

/// A picture of one of the recordings: its name in messages, its file.
struct Source<'a> {
    recording: &'a Recording,
    frame: &'a FrameRef,
    file: String,
    name: String,
}

impl Source<'_> {
    fn first_square_may_be_open(&self) -> bool {
        let board = self.recording.meta.board_of(self.frame);
        board.is_some_and(BoardSpec::first_square_may_stay_open)
    }
}

/// Searches for the board in one picture. `white`: the colour of the first square, used if the board's description
/// does not state it.
fn look(source: &Source<'_>, white: Option<bool>, options: &FindOptions) -> Result<Observation> {
    let board = source.recording.meta.board_of(source.frame).ok_or_else(no_board)?;
    let known = white.map_or_else(|| board.clone(), |white| board.beginning(white));
    let view = find(&source.recording.picture(&source.file)?, &known, options)?;
    Ok(Observation { name: source.name.clone(), features: Arc::new(board.features()), view })
}

/// Prefix of the names of each recording: empty for a single recording, otherwise its folder.
fn labels(recordings: &[Recording]) -> Vec<String> {
    let short = |r: &Recording| r.folder.file_name().map(|n| n.to_string_lossy().into_owned());
    let label = |r: &Recording| {
        let alike = recordings.iter().filter(|o| short(o) == short(r)).count();
        let folder = short(r).filter(|_| alike == 1).unwrap_or_else(|| r.folder.display().to_string());
        if recordings.len() > 1 { format!("{folder}/") } else { String::new() }
    };
    recordings.iter().map(label).collect()
}

/// All pictures of all recordings.
fn sources(recordings: &[Recording]) -> Vec<Source<'_>> {
    let mut out = Vec::new();
    for (recording, label) in recordings.iter().zip(labels(recordings)) {
        for frame in &recording.meta.frames {
            let file = frame.ambient.as_ref().or(frame.laser.as_ref()).cloned().unwrap_or_default();
            out.push(Source { recording, frame, name: format!("{label}{file}"), file });
        }
    }
    out
}

/// The picture size of all recordings; refuses recordings of different sizes, since they must come from one camera.
pub(in crate::calibrate) fn one_size(recordings: &[Recording]) -> Result<(u32, u32)> {
    let size = |r: &Recording| (r.meta.image.width, r.meta.image.height);
    let first = recordings.first().ok_or_else(|| Fault::usage("no recording was given").next("give one or more"))?;
    match recordings.iter().find(|r| size(r) != size(first)) {
        None => Ok(size(first)),
        Some(other) => Err(Fault::input(format!(
            "{} holds pictures of {}x{}, {} of {}x{}",
            first.folder.display(),
            size(first).0,
            size(first).1,
            other.folder.display(),
            size(other).0,
            size(other).1
        ))
        .cause("two cameras, or one at two resolutions")
        .next("calibrate each camera and resolution separately")),
    }
}

/// The result of the search in all pictures.
pub(in crate::calibrate) struct Pictures {
    pub found: Vec<Observation>,
    /// Name of each excluded picture, and the reason.
    pub left_out: Vec<(String, String)>,
    /// SHA-256 by name, of the used pictures and of the files that describe them.
    pub inputs: BTreeMap<String, String>,
}

/// Searches for the board in every picture (in the ambient one where there is one). A picture that occurs twice
/// counts once. `progress` is called with (done, all).
pub(in crate::calibrate) fn pictures(
    recordings: &[Recording],
    options: &FindOptions,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Pictures> {
    let sources = sources(recordings);
    let all = sources.len();
    let done = std::sync::atomic::AtomicUsize::new(0);
    let mut seen = look_at_all(all, |i| {
        let seen = look(&sources[i], None, options);
        progress(done.fetch_add(1, std::sync::atomic::Ordering::Relaxed) + 1, all);
        seen
    });
    // A picture that does not show the colour of its board's first square takes it from one that does.
    if let Some(white) = seen.iter().find_map(|o| o.as_ref().ok()).map(|o| o.view.begins_white) {
        sources.par_iter().zip(&mut seen).filter(|(_, o)| o.is_err()).for_each(|(source, o)| {
            if source.first_square_may_be_open() {
                *o = look(source, Some(white), options);
            }
        });
    }
    let (mut pictures, mut left_out): (Vec<Observation>, Vec<(String, Fault)>) = Default::default();
    // SHA-256 to name: a repeated picture carries no new information.
    let mut known: BTreeMap<String, String> = BTreeMap::new();
    for (Source { recording, file, name, .. }, seen) in sources.iter().zip(seen) {
        let (name, hash) = (name.clone(), crate::rig::hash_file(&recording.folder.join(file)).ok());
        let first = hash.as_ref().and_then(|h| known.get(h));
        if let (Some(first), Ok(_)) = (first, &seen) {
            let again = Fault::refused(format!("it is the same picture as {first}"))
                .cause("a copied picture: its board is parallel to the first one's and adds no information")
                .next("take a picture of the board at another tilt instead");
            left_out.push((name, again));
            continue;
        }
        known.extend(hash.map(|h| (h, name.clone())));
        match seen {
            Ok(o) => pictures.push(o),
            // Wrong sizes, missing files and wrong board descriptions are faults of the recording, not of one
            // picture.
            Err(fault) if fault.kind != Kind::Refused => return Err(fault),
            Err(fault) => left_out.push((name, fault)),
        }
    }
    if pictures.len() < 2 {
        return Err(too_few(pictures.len(), all, &left_out));
    }
    let found = |name: &String| pictures.iter().any(|o| o.name == *name);
    let mut inputs: BTreeMap<String, String> =
        known.into_iter().filter(|(_, name)| found(name)).map(|(hash, name)| (name, hash)).collect();
    for (recording, label) in recordings.iter().zip(labels(recordings)) {
        inputs.insert(format!("{label}meta.json"), crate::rig::hash_file(&recording.folder.join("meta.json"))?);
    }
    let left_out = left_out.into_iter().map(|(n, f)| (n, format!("{} ({})", f.what, f.cause))).collect();
    Ok(Pictures { found: pictures, left_out, inputs })
}

fn no_board() -> Fault {
    Fault::input("the recording describes no board")
        .cause("meta.json has neither 'board' nor 'boards'")
        .next("describe the board in meta.json; sheetlight board writes such a description")
}

/// The fault of recordings that show their board in too few pictures.
fn too_few(found: usize, all: usize, left_out: &[(String, Fault)]) -> Fault {
    // The most frequent reason among the pictures; the first one of equally frequent reasons.
    let votes = |l: &(String, Fault)| left_out.iter().filter(|o| o.1.cause == l.1.cause).count();
    let most = left_out.iter().rev().max_by_key(|l| votes(l));
    let unsearched = all - found - left_out.len();
    // The search ended because some agree about another size; others of these may blame the picture's edge.
    let sized = left_out.iter().find(|l| unsearched > 0 && l.1.cause == WRONG_SIZE);
    let first = sized.or(most).map(|l| l.1.clone());
    let alike = |a: &Fault, b: &Fault| a.cause == b.cause && a.next == b.next;
    let listed: String = (0..left_out.len())
        .filter(|i| !left_out[..*i].iter().any(|l| alike(&l.1, &left_out[*i].1)))
        .map(|i| {
            let (name, fault) = &left_out[i];
            let names: Vec<&String> = left_out.iter().filter(|l| alike(&l.1, fault)).map(|l| &l.0).collect();
            let more = match names[..] {
                [_] => String::new(),
                [_, other] => format!(" and {other}"),
                [.., last] => format!(" ... {last} ({} pictures)", names.len()),
                [] => unreachable!("the picture itself"),
            };
            format!("\n    {name}{more}: {}", fault.what)
        })
        .collect();
    let not_searched = match unsearched {
        0 => String::new(),
        n => format!("; {} agree about another board, and the other {n} were not searched", left_out.len()),
    };
    Fault::refused(format!(
        "the board was found in {found} of {all} pictures, 3 or more are needed{not_searched}{listed}"
    ))
    .cause(first.as_ref().map_or("too few pictures", |f| f.cause.as_str()))
    .next(first.as_ref().map_or("take 10 to 20 pictures of the board", |f| f.next.as_str()))
}
