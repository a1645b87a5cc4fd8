//! Reads what GDAL, ImageJ and OME write about samples into the texts of a TIFF.

use super::says::unit_mm;
use crate::fault::{Fault, Result};

fn refused(what: String) -> Fault {
    Fault::input(what)
        .cause("a slip of the program that wrote the file, or a statement that is not followed here")
        .next("correct the tag, or apply it and save the result as 32 bits")
}

/// Factor and offset of a linear scale, from numbers as text.
fn line(factor: Option<&str>, offset: Option<&str>) -> Result<Option<[f64; 2]>> {
    if factor.is_none() && offset.is_none() {
        return Ok(None);
    }
    let [factor, offset] = [factor.unwrap_or("1").trim(), offset.unwrap_or("0").trim()];
    let number = |t: &str| t.parse::<f64>().ok().filter(|v| v.is_finite());
    match (number(factor), number(offset)) {
        (Some(factor), Some(offset)) if factor != 0.0 => Ok(Some([factor, offset])),
        _ => Err(refused(format!("scales its samples by '{factor}' and adds '{offset}', which are no usable numbers"))),
    }
}

/// What GDAL's metadata (tag 42112) state about the first band.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Gdal {
    pub scale: Option<[f64; 2]>,
    /// mm in a unit of the heights, and its name.
    pub unit: Option<(f64, String)>,
}

impl Gdal {
    /// `<Item name="SCALE" sample="0" role="scale">0.01</Item>`, and the same for the offset and the unit. Other bands
    /// than the first are alpha.
    pub fn of(xml: &str) -> Result<Gdal> {
        let xml = without_comments(xml);
        let mut found: [Option<&str>; 3] = [None; 3];
        for item in xml.split("<Item").skip(1) {
            let Some((attributes, rest)) = item.split_once('>') else { continue };
            let value = if attributes.ends_with('/') { "" } else { rest.split('<').next().unwrap_or("").trim() };
            let role = attribute(attributes, "role");
            let Some(k) = ["scale", "offset", "unittype"].iter().position(|r| role == Some(r)) else { continue };
            if attribute(attributes, "sample").is_some_and(|band| band.trim() != "0") {
                continue;
            }
            match found[k] {
                Some(before) if before != value => {
                    let role = role.unwrap_or_default();
                    return Err(refused(format!(
                        "states two values of {role}, {before} and {value} (GDAL, tag 42112)"
                    )));
                }
                _ => found[k] = Some(value),
            }
        }
        let unit = found[2].and_then(|u| Some((unit_mm(u)?, format!("{u} (GDAL UNITTYPE, tag 42112)"))));
        Ok(Gdal { scale: line(found[0], found[1])?, unit })
    }
}

fn without_comments(xml: &str) -> String {
    let mut parts = xml.split("<!--");
    let first = parts.next().unwrap_or("").to_owned();
    parts.fold(first, |plain, part| plain + part.split_once("-->").map_or("", |(_, rest)| rest))
}

/// The value of an attribute in single or double quotes.
fn attribute<'a>(text: &'a str, name: &str) -> Option<&'a str> {
    text.match_indices(name).find_map(|(at, _)| {
        let alone = text[..at].chars().next_back().is_none_or(char::is_whitespace);
        let value = text[at + name.len()..].trim_start().strip_prefix('=').filter(|_| alone)?.trim_start();
        let quote = value.chars().next().filter(|c| "\"'".contains(*c))?;
        value[1..].split_once(quote).map(|(value, _)| value)
    })
}

/// A value of ImageJ's description, `key=value` in a line of its own.
pub(super) fn imagej_value<'a>(description: &'a str, key: &str) -> Option<&'a str> {
    let value = |l: &'a str| Some(l.trim().strip_prefix(key)?.strip_prefix('=')?.trim());
    description.starts_with("ImageJ").then(|| description.lines().find_map(value)).flatten()
}

/// ImageJ stores signed whole numbers as unsigned ones and states how to undo it: `cf=0`, `c0=-32768`, `c1=1`.
pub(super) fn scale_of_imagej(description: &str) -> Result<Option<[f64; 2]>> {
    let value = |key: &str| imagej_value(description, key);
    match value("cf") {
        None => Ok(None),
        Some("0") => line(value("c1"), value("c0")),
        Some(other) => {
            Err(refused(format!("calibrates its samples by ImageJ's function {other}; allowed: 0, a straight line"))
                .cause("a kind of TIFF that is not read here")
                .next("in ImageJ apply the calibration and save the result as 32 bits"))
        }
    }
}

/// The unit of the samples.
pub(super) fn unit_of_imagej(description: &str) -> Option<(f64, String)> {
    let unit = imagej_value(description, "vunit")?;
    Some((unit_mm(unit)?, format!("{unit} (ImageJ vunit, tag 270)")))
}

/// The distance of columns and rows from pixels in a unit.
pub(super) fn spacing_of_imagej(description: &str, per_unit: Option<[f64; 2]>) -> Option<([f64; 2], String)> {
    let unit = unit_mm(imagej_value(description, "unit")?)?;
    Some((per_unit?.map(|n| unit / n), "mm (ImageJ, tags 270, 282 and 283)".into()))
}

/// The distance of columns and rows in OME-XML; its unit is the micrometre unless stated.
pub(super) fn spacing_of_ome(description: &str) -> Option<([f64; 2], String)> {
    let pixels = description.split_once("<Pixels")?.1.split('>').next()?;
    let side = |name: &str| {
        let unit = attribute(pixels, &format!("PhysicalSize{name}Unit")).map_or(Some(1e-3), unit_mm)?;
        let size = attribute(pixels, &format!("PhysicalSize{name}"))?.trim().parse::<f64>().ok();
        size.filter(|s| s.is_finite() && *s > 0.0).map(|s| s * unit)
    };
    Some(([side("X")?, side("Y")?], "mm (OME PhysicalSize, tag 270)".into()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_are_read_and_strange_ones_refused() {
        let scale = |xml: &str| Gdal::of(xml).map(|g| g.scale);
        let xml = r#"<GDALMetadata><Item name="OFFSET" sample="0" role="offset">-5.5</Item>
            <Item name="SCALE" sample="0" role="scale">0.01</Item></GDALMetadata>"#;
        assert_eq!(scale(xml).unwrap(), Some([0.01, -5.5]));
        assert_eq!(scale(&xml.replace('"', "'")).unwrap(), Some([0.01, -5.5]));
        let other = r#"<Item name="SCALE" role="scale" sample="1">0.5</Item>"#;
        assert_eq!(scale(&format!("{other}{xml}")).unwrap(), Some([0.01, -5.5]));
        assert_eq!(scale(other).unwrap(), None);
        assert_eq!(
            scale(r#"<!-- <Item role="scale">9</Item> --><Item role = "scale">2</Item>"#).unwrap(),
            Some([2.0, 0.0])
        );
        assert_eq!(scale("<GDALMetadata></GDALMetadata>").unwrap(), None);
        let one = scale(r#"<Item role="scale">one</Item>"#).unwrap_err();
        assert!(one.what.contains("'one' and adds '0'"), "{one}");
        assert!(scale(r#"<Item role="scale">0</Item>"#).is_err());
        assert!(
            scale(r#"<Item role="scale">1</Item><Item role="scale">2</Item>"#).unwrap_err().what.contains("1 and 2")
        );
        let signed = "ImageJ=1.54f\nmin=0\ncf=0\nc0=-32768.0\nc1=1.0\nvunit=gray value\n";
        assert_eq!(scale_of_imagej(signed).unwrap(), Some([1.0, -32_768.0]));
        assert_eq!(scale_of_imagej("ImageJ=1.54f\nimages=2").unwrap(), None);
        assert_eq!(scale_of_imagej("cf=0\nc0=1\nc1=2").unwrap(), None);
        assert!(scale_of_imagej("ImageJ=1\ncf=8\nc0=1\nc1=2").is_err());
        assert!(unit_of_imagej(signed).is_none());
    }

    #[test]
    fn units_and_distances_are_read() {
        let unit = Gdal::of("<Item name='UNITTYPE' sample='0' role='unittype'>metre</Item>").unwrap().unit.unwrap();
        assert!(unit.0 == 1000.0 && unit.1.contains("metre"), "{unit:?}");
        assert_eq!(unit_of_imagej("ImageJ=1.53\nvunit=micron\n").unwrap().0, 1e-3);
        assert_eq!(spacing_of_imagej("ImageJ=1.53\nunit=mm\n", Some([10.0, 5.0])).unwrap().0, [0.1, 0.2]);
        assert!(spacing_of_imagej("unit=mm", Some([10.0; 2])).is_none());
        let ome =
            r#"<OME><Image><Pixels PhysicalSizeX="250" PhysicalSizeY="0.5" PhysicalSizeYUnit="mm"/></Image></OME>"#;
        assert_eq!(spacing_of_ome(ome).unwrap().0, [0.25, 0.5]);
    }
}
