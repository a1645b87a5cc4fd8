//! In: a part's template, with its mask, and pictures or height maps. Out: the part's position in each of them: JSON,
//! CSV, a picture with the matches drawn in.
//! Frame and unit: pixels of each picture, cells of each map (x right, y down, an integer is a centre); in maps also mm
//! in the grid frame; degrees, x towards y.

use crate::cli::terminal::arguments::{numbers, parse};
use crate::cli::terminal::console::Console;
use crate::cli::terminal::outputs;
use crate::cli::terminal::outputs::Inputs;
use sheetlight::fault::{Fault, Result};
use sheetlight::find::model::masked::{either, excluded};
use sheetlight::find::search::picture::draw;
use sheetlight::find::{
    Accelerator, Area, Example, Match, ModelOptions, Scene, SearchOptions, Template, Weak, find_taught, teach_examples,
};
use sheetlight::raster::{Channel, Depth, Image, Mask, decode_in_part, load_in_part};
use sheetlight::rig::hash_text;
use sheetlight::scan::HeightMap;
use std::path::{Path, PathBuf};

/// Find a part in pictures or height maps by its edges
///
/// The template is a picture that shows the part, whole or in --template-region, or a file that sheetlight teach
/// --region wrote. Scan folders in place of pictures are searched by their heights; cells without a height count half.
/// The score is the mean cosine between the template's directions and the picture's: a part of which three tenths are
/// hidden scores about 0.7. Grey levels or heights are correlated as well. Without --score, matches in pictures that
/// score 0.4 to 0.6 are listed too if their correlation is 0.8 or more. If nothing is found, the exit code is 0.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  sheetlight match clip.png table.png --out clips.json
  sheetlight match board.png line1.png line2.png --template-region 210,90,64,40 --all \\
      --angles -5..5 --out resistors.json
  sheetlight match plate1 plate2 --template-region 300,220,180,180 --out stars.json
  sheetlight teach board.png --name resistor --region 210,90,64,40 --out resistor.json
  sheetlight match resistor.json line1.png --all --scales 0.9..1.1 --score 0.7 \\
      --polygon 100,80,900,80,900,700,100,700 --out found.json
Guide: docs/match.md")]
pub struct Args {
    /// Picture or scan of the part, or a template from teach --region (.json)
    template: PathBuf,
    /// Pictures to search (PNG, JPEG, TIFF, BMP, PGM), or scan folders
    #[arg(required = true)]
    pictures: Vec<PathBuf>,
    /// Part in the template's picture, px: x,y of the top left pixel, width, height [default: all]
    #[arg(long, value_name = "X,Y,W,H", value_parser = numbers::<4>)]
    template_region: Option<[f64; 4]>,
    /// White or opaque where the template's picture counts; of the picture's or the region's size
    #[arg(long, value_name = "PICTURE")]
    mask: Option<PathBuf>,
    /// Weakest edge of the template as a share of its strong ones; low includes texture
    #[arg(long, default_value_t = ModelOptions::default().contrast)]
    contrast: f64,
    /// Only matches with their middle in this rectangle, px
    #[arg(long, value_name = "X,Y,W,H", value_parser = numbers::<4>, allow_hyphen_values = true,
        conflicts_with = "polygon")]
    region: Option<[f64; 4]>,
    /// Only matches with their middle in this polygon: its corners, px
    #[arg(long, value_name = "X,Y,X,Y,...", value_delimiter = ',', allow_hyphen_values = true)]
    polygon: Vec<f64>,
    /// Turns against the template, degrees; two equal values fix the turn [default: all]
    #[arg(long, value_name = "LO..HI", value_parser = range, allow_hyphen_values = true)]
    angles: Option<[f64; 2]>,
    /// Sizes against the template's [default: 1..1]
    #[arg(long, value_name = "LO..HI", value_parser = range)]
    scales: Option<[f64; 2]>,
    /// Every match, not only the best
    #[arg(long, conflicts_with = "most")]
    all: bool,
    /// Largest number of matches per picture
    #[arg(long)]
    most: Option<usize>,
    /// Least score, 0.1 to 1 [default: 0.6]
    #[arg(long)]
    score: Option<f64>,
    /// Least score of matches in pictures whose grey levels correlate [default: 0.4 without --score]
    #[arg(long, value_name = "SCORE")]
    weak_score: Option<f64>,
    /// Largest overlap of two matches, as a share of the smaller one
    #[arg(long, default_value_t = SearchOptions::default().max_overlap)]
    overlap: f64,
    /// Ignore edge polarity
    #[arg(long)]
    ignore_polarity: bool,
    /// Channel of a colour picture: red, green, blue or luma
    #[arg(long, default_value = "luma", value_parser = parse::<Channel>)]
    channel: Channel,
    /// Depth of template and pictures, 8 to 16 bits
    #[arg(long, default_value_t = 8, value_parser = clap::value_parser!(u8).range(8..=16))]
    bits: u8,
    /// File for the matches (JSON); a table (.csv) and pictures (.png) are written beside it
    #[arg(long)]
    out: Option<PathBuf>,
}

/// The matches in one picture.
#[derive(serde::Serialize)]
struct Found {
    picture: String,
    width: u32,
    height: u32,
    matches: Vec<Listed>,
}

/// A match as it is printed and written.
#[derive(serde::Serialize)]
struct Listed {
    x_px: f64,
    y_px: f64,
    /// In the map's grid frame.
    #[serde(skip_serializing_if = "Option::is_none")]
    x_mm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    y_mm: Option<f64>,
    angle_deg: f64,
    scale: f64,
    score: f64,
    sigma_px: [f64; 2],
    sigma_deg: f64,
    sigma_scale: f64,
    edges: usize,
    edge_rms_px: f64,
    second_score: f64,
    /// Null where the template has no levels or the picture shows less than half of them.
    correlation: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    warning: Option<String>,
}

pub fn run(args: &Args, console: &Console) -> Result<()> {
    let options = options(args)?;
    let area = match (args.region, &args.polygon[..]) {
        (Some(region), _) => Some(Area::rectangle(region)?),
        (None, []) => None,
        (None, corners) if corners.len() % 2 == 0 => {
            Some(Area::polygon(corners.chunks_exact(2).map(|c| [c[0], c[1]]).collect())?)
        }
        (None, corners) => {
            return Err(Fault::usage(format!("--polygon has {} numbers, wanted pairs", corners.len()))
                .next("give x,y of each corner"));
        }
    };
    let overlays = overlays(args);
    let results: Vec<PathBuf> =
        args.out.iter().flat_map(|o| [o.clone(), o.with_extension("csv")]).chain(overlays.iter().cloned()).collect();
    let inputs = args.pictures.iter().chain([&args.template]).chain(&args.mask).map(PathBuf::as_path);
    let (scans, files): (Vec<&Path>, Vec<&Path>) = inputs.partition(|path| path.is_dir());
    let results: Vec<&Path> = results.iter().map(PathBuf::as_path).collect();
    outputs::check(&results, &Inputs { files: &files, scans: &scans, ..Inputs::default() })?;
    let template = template(args)?;
    let weak = weak(args);
    if args.weak_score.is_some() && template.mm_per_px.is_some() {
        return Err(Fault::usage("--weak-score with a height map")
            .cause("heights are compared, but round parts of other sizes correlate too")
            .next("omit --weak-score and give --score"));
    }
    if template.levels.is_none() {
        console.say("the template has no levels, so nothing is correlated: teach the part again");
    }
    let accelerator = Accelerator::open();
    let (mut all, mut drawn) = (Vec::new(), Vec::new());
    for (k, path) in args.pictures.iter().enumerate() {
        let (scene, image) = searched(path, args)?;
        let at = |e: Fault| e.at(path.display());
        let cells = template.cells_in(&scene).map_err(at)?;
        let options = SearchOptions { scales: options.scales.map(|s| s * cells), ..options };
        let matches = find_taught(&scene, &template, &options, weak.as_ref(), area.as_ref(), accelerator.as_ref());
        let matches = matches.map_err(at)?;
        if let Some(file) = overlays.get(k) {
            drawn.push((file, draw(&image, &template.model, &matches).to_png()));
        }
        all.push(Found {
            picture: path.display().to_string(),
            width: image.width,
            height: image.height,
            matches: matches.into_iter().map(|m| listed(m, &options, cells, scene.mm_per_px)).collect(),
        });
    }
    let said =
        serde_json::json!({"format": 1, "units": units(&template), "template": said_of(&template), "pictures": all});
    if let Some(out) = &args.out {
        let csv = table(&all);
        let csv_file = out.with_extension("csv");
        let beside: Vec<(&Path, &[u8])> = std::iter::once((csv_file.as_path(), csv.as_bytes()))
            .chain(drawn.iter().map(|(file, png)| (file.as_path(), png.as_slice())))
            .collect();
        let text = serde_json::to_string_pretty(&said).expect("plain data");
        sheetlight::files::write_beside((out, text.as_bytes()), &beside)?;
        console.say(format!("see {}, {} and {}", out.display(), csv_file.display(), overlays[0].display()));
    }
    console.result(&said, &summary(&all));
    Ok(())
}

fn options(args: &Args) -> Result<SearchOptions> {
    let most = SearchOptions::MOST_MATCHES;
    let defaults = SearchOptions::default();
    let max_matches = if args.all { most } else { args.most.unwrap_or(1) };
    let options = SearchOptions {
        angles_deg: args.angles.unwrap_or(defaults.angles_deg),
        scales: args.scales.unwrap_or(defaults.scales),
        min_score: args.score.unwrap_or(defaults.min_score),
        max_overlap: args.overlap,
        ignore_polarity: args.ignore_polarity,
        ..defaults.at_most(max_matches)
    };
    options.check()?;
    Ok(options)
}

/// Down to which score the correlation decides. A stated --score alone is a limit that nothing passes below.
fn weak(args: &Args) -> Option<Weak> {
    let usual = Weak::default();
    match (args.weak_score, args.score) {
        (Some(min_score), _) => Some(Weak { min_score, ..usual }),
        (None, None) => Some(usual),
        (None, Some(_)) => None,
    }
}

fn template(args: &Args) -> Result<Template> {
    let path = &args.template;
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("json")) {
        if args.template_region.is_some() {
            return Err(Fault::usage("--template-region with a taught part")
                .cause("a file of sheetlight teach has its region in it")
                .next("omit --template-region, or give the picture"));
        }
        if args.mask.is_some() {
            return Err(Fault::usage("--mask with a taught part")
                .cause("a file of sheetlight teach knows already what counts")
                .next("give --mask to sheetlight teach, or give the picture"));
        }
        return Template::parse(&sheetlight::files::read_text(path)?).map_err(|e| e.at(path.display()));
    }
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    let options = ModelOptions { contrast: args.contrast, ..ModelOptions::default() };
    let region = whole_region(args.template_region)?;
    let mask = args.mask.as_deref();
    if path.is_dir() {
        return taught_map(path, &name, region, mask, &options).map(|t| t.0);
    }
    let part = Pictured::load(path, (args.channel, args.bits), mask, region)?;
    teach_examples(&name, &[part.example()], region, &options, None).map_err(|e| e.at(path.display()))
}

fn depth(bits: u8) -> Depth {
    Depth {
        bits,
        declared: "--bits says",
        correct: "give --bits the depth of the sensor: 8, or 9 to 16 for files of 16 bits",
        saturates: false,
    }
}

/// Most bytes of a picture file from which a part is taught.
const MOST_BYTES: u64 = 1 << 30;

/// What is searched: the height map of a scan folder, or a picture; and a picture to draw on.
fn searched(path: &Path, args: &Args) -> Result<(Scene, Image)> {
    if path.is_dir() {
        let map = HeightMap::load(path)?;
        return Ok((Scene::from_heights(&map).map_err(|e| e.at(path.display()))?, grey(&map)));
    }
    let (image, hidden) = load_in_part(path, args.channel, depth(args.bits))?;
    Ok((Scene::from_image_in_part(&image, hidden.as_ref()), image))
}

/// Heights as grey levels from 40 to 255, the lowest and highest hundredth cut off; black where nothing was measured.
fn grey(map: &HeightMap) -> Image {
    let (low, high) = map.quantiles(0.01, 0.99).unwrap_or((0.0, 1.0));
    let span = (high - low).max(1e-6);
    let level = |z: &f32| if z.is_finite() { 40 + (215.0 * ((z - low) / span).clamp(0.0, 1.0)) as u8 } else { 0 };
    Image::from_u8(map.width, map.height, map.z.iter().map(level).collect())
}

/// A region in whole pixels.
pub(super) fn whole_region(region: Option<[f64; 4]>) -> Result<Option<[u32; 4]>> {
    let whole = |v: f64| (v.fract() == 0.0 && (0.0..1e6).contains(&v)).then_some(v as u32);
    match region.map(|r| r.map(whole)) {
        None => Ok(None),
        Some([Some(x), Some(y), Some(w), Some(h)]) => Ok(Some([x, y, w, h])),
        Some(_) => Err(Fault::usage("the template's region is not in whole pixels from 0 on")
            .cause("millimetres, or a corner outside the picture")
            .next("give x,y of the top left pixel, width and height")),
    }
}

/// Where a mask's file excludes what a picture or map of this size shows.
fn masked(file: &Path, size: [u32; 2], region: Option<[u32; 4]>) -> Result<Mask> {
    let (mask, clear) = load_in_part(file, Channel::Luma, 8)?;
    excluded(&mask, clear.as_ref(), size, region).map_err(|e| e.at(file.display()))
}

/// A picture file of a part.
pub(super) struct Pictured {
    pub image: Image,
    /// Transparent pixels and those that a mask excludes.
    hidden: Option<Mask>,
    named: String,
    sha256: String,
}

impl Pictured {
    /// Reads the picture and its mask, which is as large as the picture or as its region.
    pub fn load(
        path: &Path,
        (channel, bits): (Channel, u8),
        mask: Option<&Path>,
        region: Option<[u32; 4]>,
    ) -> Result<Pictured> {
        let bytes = sheetlight::files::read(path, MOST_BYTES)?;
        let (image, hidden) = decode_in_part(&bytes, channel, depth(bits)).map_err(|e| e.at(path.display()))?;
        let mask = mask.map(|file| masked(file, [image.width, image.height], region)).transpose()?;
        Ok(Pictured { hidden: either(hidden, mask), image, named: named(path), sha256: hash_text(&bytes) })
    }

    pub fn example(&self) -> Example<'_> {
        Example {
            image: &self.image,
            hidden: self.hidden.as_ref(),
            picture: self.named.clone(),
            sha256: self.sha256.clone(),
        }
    }
}

fn named(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// The part in a region of a scan's height map, and the map as a picture. Masked cells count as not measured.
pub(super) fn taught_map(
    path: &Path,
    name: &str,
    region: Option<[u32; 4]>,
    mask: Option<&Path>,
    options: &ModelOptions,
) -> Result<(Template, Image)> {
    let mut map = HeightMap::load(path)?;
    let shown = grey(&map);
    if let Some(file) = mask {
        let (mask, width) = (masked(file, [map.width, map.height], region)?, map.width);
        let cells = (0..).map(|i| (i % width, i / width));
        map.z.iter_mut().zip(cells).filter(|(_, (x, y))| mask.get(*x, *y)).for_each(|(z, _)| *z = f32::NAN);
    }
    let source = (named(path), hash_text(&sheetlight::files::read(&path.join("height.tif"), MOST_BYTES)?));
    let taught = Template::teach_map(name, &map, region, source, options).map_err(|e| e.at(path.display()))?;
    Ok((taught, shown))
}

/// One output picture per searched one, next to the list; numbered if there are several.
fn overlays(args: &Args) -> Vec<PathBuf> {
    let Some(out) = &args.out else { return vec![] };
    if args.pictures.len() == 1 {
        return vec![out.with_extension("png")];
    }
    let stem = out.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    (1..=args.pictures.len()).map(|k| out.with_file_name(format!("{stem}_{k}.png"))).collect()
}

fn units(t: &Template) -> &'static str {
    if t.mm_per_px.is_some() { "px, mm, degrees" } else { "px, degrees" }
}

fn said_of(t: &Template) -> serde_json::Value {
    let mut said = serde_json::json!({"name": t.name, "picture": t.picture, "picture_sha256": t.picture_sha256,
        "region_px": t.region_px, "edges": t.model.levels[0].len(), "reference": "the middle of the region"});
    if let Some(mm) = t.mm_per_px {
        said["mm_per_px"] = mm.into();
    }
    said
}

fn listed(m: Match, options: &SearchOptions, cells: f64, mm_per_px: Option<f64>) -> Listed {
    let mm = |px: f64| mm_per_px.map(|mm| (px + 0.5) * mm);
    Listed {
        x_px: m.pose.x,
        y_px: m.pose.y,
        x_mm: mm(m.pose.x),
        y_mm: mm(m.pose.y),
        angle_deg: options.turn_deg(m.pose.angle),
        scale: m.pose.scale / cells,
        score: m.score,
        sigma_px: m.sigma_px,
        sigma_deg: m.sigma_deg,
        sigma_scale: m.sigma_scale / cells,
        edges: m.edges,
        edge_rms_px: m.edge_rms_px,
        second_score: m.second_score,
        correlation: m.correlation,
        warning: m.warning,
    }
}

fn table(all: &[Found]) -> String {
    let mut s = String::from(
        "picture,number,x_px,y_px,angle_deg,scale,score,sigma_x_px,sigma_y_px,sigma_deg,sigma_scale,correlation\n",
    );
    for f in all {
        for (k, m) in f.matches.iter().enumerate() {
            s += &format!(
                "\"{}\",{},{:.4},{:.4},{:.4},{:.5},{:.4},{:.4},{:.4},{:.4},{:.5},{}\n",
                f.picture.replace('"', "\"\""),
                k + 1,
                m.x_px,
                m.y_px,
                m.angle_deg,
                m.scale,
                m.score,
                m.sigma_px[0],
                m.sigma_px[1],
                m.sigma_deg,
                m.sigma_scale,
                m.correlation.map_or(String::new(), |c| format!("{c:.4}"))
            );
        }
    }
    s
}

fn summary(all: &[Found]) -> String {
    let mut s = String::new();
    for f in all {
        s += &format!(
            "{}: {}\n",
            f.picture,
            match f.matches.len() {
                0 => "not found".into(),
                1 => "1 match".into(),
                n => format!("{n} matches"),
            }
        );
        for (k, m) in f.matches.iter().enumerate() {
            s += &format!(
                "{:4}  {:9.3} {:9.3} px  {:8.3} degrees  scale {:.4}  score {:.3}  correlation {}  sigma {:.3} \
                 {:.3} px, {:.3} degrees{}\n",
                k + 1,
                m.x_px,
                m.y_px,
                m.angle_deg,
                m.scale,
                m.score,
                m.correlation.map_or("none".into(), |c| format!("{c:.3}")),
                m.sigma_px[0],
                m.sigma_px[1],
                m.sigma_deg,
                m.warning.as_ref().map_or(String::new(), |w| format!("; {w}"))
            );
        }
    }
    s
}

/// LO..HI.
fn range(s: &str) -> std::result::Result<[f64; 2], String> {
    let number = |v: &str| v.trim().parse().ok().filter(|v: &f64| v.is_finite());
    let read = s.split_once("..").and_then(|(a, b)| Some([number(a)?, number(b)?]));
    read.ok_or_else(|| format!("'{s}' is not like -5..5"))
}
