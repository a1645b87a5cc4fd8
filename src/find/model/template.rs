//! In: a picture or a height map and the region of it that shows the part, or a file made from them. Out: a model with
//! its origin, for searches in other pictures or maps; the file.
//! Frame and unit: pixels of the picture, cells of the map; points of the model about the region's middle, turn 0 as
//! in the picture.

use super::levels::Levels;
use super::shape_model::{MIN_POINTS, ModelOptions, ModelPoint, ShapeModel};
use crate::fault::{Fault, Result};
use crate::find::scene::{Kind, Region, Scene};
use crate::raster::{Image, Mask};
use crate::scan::HeightMap;

/// A part as one picture or height map shows it. `teach --region` writes it and `match` reads it.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Template {
    /// Version of this file: 1.
    pub format: u32,
    /// Name of the part.
    pub name: String,
    /// Name of the picture or scan that it was taught from, as stated then.
    pub picture: String,
    /// SHA-256 of that picture's file, or of the map's height.tif.
    pub picture_sha256: String,
    /// Edge of a cell of the height map, mm; `None` for a picture.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mm_per_px: Option<f64>,
    /// Region of the part in that picture: x, y of its top left pixel, width, height; px.
    pub region_px: [u32; 4],
    /// How the edges were chosen.
    pub options: ModelOptions,
    /// The part's edges.
    pub model: ShapeModel,
    /// The region's grey levels, or heights; `None` in files of before they were stored, and in an even region.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub levels: Option<Levels>,
    /// The further examples that it was taught from.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub examples: Vec<Taken>,
    /// With further examples: number of the first one's edge points that the others confirm, and of all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub confirmed: Option<[usize; 2]>,
}

/// Where an example's part was found.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Taken {
    /// Name of the picture, as stated then.
    pub picture: String,
    /// SHA-256 of the picture's file.
    pub picture_sha256: String,
    /// Column of the reference point, px.
    pub x_px: f64,
    /// Row of the reference point, px.
    pub y_px: f64,
    /// Turn against the first example, x towards y, degrees.
    pub angle_deg: f64,
    /// Score against the first example.
    pub score: f64,
    /// Correlation with the first example.
    pub correlation: Option<f64>,
}

/// No picture gives edges farther than this from the part's middle, px.
const FARTHEST_PX: f64 = 131_072.0;
/// Most edge points of a level in a file, the upper limit of [`ModelOptions::max_points`].
const MOST_PLACES: usize = 5000;

/// Refuses a region (x, y, width, height) that is empty or leaves the picture.
fn within([x, y, w, h]: [u32; 4], [width, height]: [u32; 2], of: &str) -> Result<()> {
    let fits = |from: u32, length: u32, most: u32| length > 0 && u64::from(from) + u64::from(length) <= most.into();
    if fits(x, w, width) && fits(y, h, height) {
        return Ok(());
    }
    Err(Fault::usage(format!(
        "the region {x},{y},{w},{h} (x,y,width,height) does not lie in the {of} of {width}x{height} px"
    ))
    .cause("the last two numbers are a corner instead of width and height, or the numbers are of another picture")
    .next("give x,y of the top left pixel, width and height"))
}

impl Template {
    /// Learns what `region` shows (x, y, width, height; `None`: the whole picture). `source` is the picture's name and
    /// SHA-256.
    ///
    /// # Errors
    /// A region that leaves the picture, one without a clear outline.
    pub fn teach(
        name: &str,
        image: &Image,
        region: Option<[u32; 4]>,
        source: (String, String),
        options: &ModelOptions,
    ) -> Result<Template> {
        Template::teach_in_part(name, image, None, region, source, options)
    }

    /// The same for a picture that is hidden where `hidden` is set, such as a part that was cut out in an editor:
    /// nothing is learnt there. Visible grey levels continue behind the rim, so that the rim itself makes no edge but
    /// an edge along it is preserved.
    ///
    /// # Errors
    /// Those of [`Template::teach`].
    pub fn teach_in_part(
        name: &str,
        image: &Image,
        hidden: Option<&Mask>,
        region: Option<[u32; 4]>,
        source: (String, String),
        options: &ModelOptions,
    ) -> Result<Template> {
        let [x, y, w, h] = region.unwrap_or([0, 0, image.width, image.height]);
        within([x, y, w, h], [image.width, image.height], "picture")?;
        let cells = cells([x, y, w, h]);
        let seen = Scene::from_image_in_part(image, hidden);
        let levels = Levels::of(&seen.layers[0].crop(cells));
        let model = match hidden {
            None => ShapeModel::from_region(&seen, cells, None, options)?,
            Some(hidden) => {
                let reference = [f64::from(x) + 0.5 * f64::from(w - 1), f64::from(y) + 0.5 * f64::from(h - 1)];
                let carried = seen.carried_on();
                let model = ShapeModel::from_region(&carried, cells, Some(reference), options)?;
                let [columns, rows] = [hidden.width, hidden.height].map(|n| f64::from(n - 1));
                let place = |v: f64, most: f64| v.round().clamp(0.0, most) as u32;
                let seen =
                    |p: &ModelPoint| !hidden.get(place(reference[0] + p.x, columns), place(reference[1] + p.y, rows));
                model.only(seen)?
            }
        };
        Ok(Template {
            format: 1,
            name: name.into(),
            picture: source.0,
            picture_sha256: source.1,
            mm_per_px: None,
            region_px: [x, y, w, h],
            options: *options,
            model,
            levels,
            examples: vec![],
            confirmed: None,
        })
    }

    /// Learns what `region` of a height map shows. Cells without a height make no edge. `source` is the scan's name and
    /// the SHA-256 of its height.tif.
    ///
    /// # Errors
    /// A region that leaves the map, one without a clear outline.
    pub fn teach_map(
        name: &str,
        map: &HeightMap,
        region: Option<[u32; 4]>,
        source: (String, String),
        options: &ModelOptions,
    ) -> Result<Template> {
        let region_px = region.unwrap_or([0, 0, map.width, map.height]);
        within(region_px, [map.width, map.height], "map")?;
        let scene = Scene::from_heights(map)?;
        let model = ShapeModel::from_region(&scene, cells(region_px), None, options)?;
        let levels = Levels::of(&scene.layers[0].crop(cells(region_px)));
        let (picture, picture_sha256) = source;
        let mm_per_px = Some(map.cell);
        Ok(Template {
            format: 1,
            name: name.into(),
            picture,
            picture_sha256,
            mm_per_px,
            region_px,
            options: *options,
            model,
            levels,
            examples: vec![],
            confirmed: None,
        })
    }

    /// How many cells of a scene one cell of the template is: 1 for pictures, which have no scale of their own.
    ///
    /// # Errors
    /// A picture's template for a map or the other way round; cells of very different sizes.
    pub fn cells_in(&self, scene: &Scene) -> Result<f64> {
        match (self.mm_per_px, scene.mm_per_px) {
            (None, None) => Ok(1.0),
            (Some(own), Some(cell)) if (0.5..=2.0).contains(&(own / cell)) => Ok(own / cell),
            (Some(own), Some(cell)) => Err(Fault::input(format!(
                "the map's cells are {cell} mm wide, those of the template {own} mm; allowed: half to twice as wide"
            ))
            .cause("a scan with other steps or of another sensor")
            .next("grid the scan with cells as wide as the template's, or teach the part on such a map")),
            (Some(_), None) => Err(Fault::usage("a picture is searched for a part that a height map taught")
                .cause("a picture in place of a scan folder")
                .next("give a scan folder, or teach the part from a picture: its grey levels are other edges")),
            (None, Some(_)) => Err(Fault::usage("a height map is searched for a part that a picture taught")
                .cause("a scan folder in place of a picture")
                .next("give a picture, or teach the part from a scan folder: its heights are other edges")),
        }
    }

    /// Parses a file and checks every number in it.
    ///
    /// # Errors
    /// Text that is no template, and numbers that no picture gives.
    pub fn parse(text: &str) -> Result<Template> {
        let strange = |what: String| {
            Fault::input(format!("is not a taught part: {what}"))
                .cause("another file, another version, or edited by hand")
                .next("teach the part again: sheetlight teach PICTURE --region X,Y,W,H --out PART.json")
        };
        let template: Template = serde_json::from_str(text).map_err(|e| strange(e.to_string()))?;
        if template.format != 1 {
            return Err(strange(format!("format {}, this version reads 1", template.format)));
        }
        template.options.check().map_err(|e| strange(e.what))?;
        check(&template).map_err(strange)?;
        Ok(template)
    }
}

fn cells([x, y, w, h]: [u32; 4]) -> Region {
    let end = |a: u32, b: u32| a as usize + b as usize;
    Region { x0: x as usize, y0: y as usize, x1: end(x, w), y1: end(y, h) }
}

fn check(template: &Template) -> std::result::Result<(), String> {
    if let Some(levels) = &template.levels {
        let [_, _, w, h] = template.region_px;
        levels.check([w, h])?;
    }
    let (model, kind) = match template.mm_per_px {
        None => (&template.model, Kind::Intensity),
        Some(mm) if mm > 0.0 && mm.is_finite() => (&template.model, Kind::Height),
        Some(mm) => return Err(format!("cells of {mm} mm; allowed: above 0")),
    };
    if !(1..=8).contains(&model.levels.len()) {
        return Err(format!("{} levels; allowed: 1 to 8", model.levels.len()));
    }
    for (level, points) in model.levels.iter().enumerate() {
        if !(MIN_POINTS..=MOST_PLACES).contains(&points.len()) {
            return Err(format!(
                "{} edge places on level {level}; allowed: {MIN_POINTS} to \
                                {MOST_PLACES}",
                points.len()
            ));
        }
        let strange = |p: &ModelPoint| {
            let unit = (p.gx.hypot(p.gy) - 1.0).abs() < 1e-6;
            !(p.x.hypot(p.y) <= FARTHEST_PX && unit && p.kind == kind)
        };
        if let Some(p) = points.iter().find(|p| strange(p)) {
            return Err(format!("an edge at {}, {} with direction {}, {}", p.x, p.y, p.gx, p.gy));
        }
    }
    let sizes = model.half_size.iter().chain([&model.radius]);
    if sizes.clone().any(|v| !(*v >= 0.0 && *v <= FARTHEST_PX))
        || model.centre.iter().any(|v| !(v.abs() <= FARTHEST_PX))
    {
        return Err("sizes that no picture gives".into());
    }
    let reach = model.levels[0].iter().map(|p| p.x.hypot(p.y)).fold(0.0, f64::max);
    if (reach - model.radius).abs() > 1e-3 {
        return Err(format!("a radius of {} px, its edges reach {reach:.3} px", model.radius));
    }
    if !(1.0..=MOST_PLACES as f64).contains(&model.redundancy) {
        return Err(format!("a redundancy of {}; allowed: 1 to {MOST_PLACES}", model.redundancy));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_taught_comes_back_and_strange_numbers_do_not() {
        let pixels =
            (0..64 * 48).map(|i| if (16..48).contains(&(i % 64)) && (12..36).contains(&(i / 64)) { 200 } else { 20 });
        let image = Image::from_u8(64, 48, pixels.collect());
        let source = ("a.png".to_owned(), "0".repeat(64));
        let taught =
            Template::teach("box", &image, Some([8, 6, 48, 36]), source.clone(), &ModelOptions::default()).unwrap();
        let text = serde_json::to_string(&taught).unwrap();
        assert_eq!(Template::parse(&text).unwrap(), taught);
        for (from, to) in [
            ("\"format\":1", "\"format\":2"),
            ("\"radius\":", "\"radius\":1e9,\"radiu\":"),
            ("\"gx\":", "\"gx\":3.0,\"g\":"),
            ("\"redundancy\":", "\"redundancy\":0.5,\"redundanc\":"),
        ] {
            assert!(Template::parse(&text.replacen(from, to, 1)).is_err(), "{to}");
        }
        let mut far = taught.clone();
        far.model.levels[0][0].x = 1e7;
        assert!(Template::parse(&serde_json::to_string(&far).unwrap()).unwrap_err().what.contains("an edge at"));
        let outside = Template::teach("box", &image, Some([8, 6, 60, 36]), source, &ModelOptions::default());
        assert!(outside.unwrap_err().what.contains("(x,y,width,height) does not lie in the picture of 64x48 px"));
    }
}
