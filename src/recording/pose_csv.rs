//! In: a pose file in CSV. Out: numbered rows of numbers in the convention that the file names; columns, units and
//! order must match that convention.
//! Frame and unit: those of the convention (docs/conventions.md).

use crate::fault::{Fault, Result};
use crate::files::{TableRow, stated, table};
use crate::robot::Convention;

/// One pose: its number, its convention, its values.
pub(super) type Row = (usize, Convention, Vec<f64>);

/// The rows of a file, and whether its header states the units of lengths and of angles.
pub(super) struct Read {
    pub rows: Vec<Row>,
    pub length_stated: bool,
    pub angle_stated: bool,
}

/// `frame,m00,...,m33` is a matrix in mm; every other layout is preceded by a line `# convention: NAME`.
pub(super) fn read(text: &str) -> Result<Read> {
    let convention = convention(text)?;
    let in_mm = stated_mm(
        text,
        "convert the positions to mm (of matrices the columns m03, m13, m23); other notations may state units in the \
         columns' names: X_mm,...,RX_deg",
    )?;
    let (mut header, mut rows) = (None, Vec::new());
    for r in table(text, ',') {
        let here = |e: Fault| e.at(format!("line {}", r.line));
        match &header {
            None => header = Some(Header::read(&r, convention).map_err(here)?),
            Some(h) => rows.push(row(&r, h).map_err(here)?),
        }
    }
    let stated = |k: fn(&Header) -> bool| header.as_ref().is_some_and(k);
    Ok(Read { length_stated: in_mm || stated(|h| h.length_stated), angle_stated: stated(|h| h.angle_stated), rows })
}

/// The convention that the comments name.
fn convention(text: &str) -> Result<Option<Convention>> {
    let mut named = None;
    for name in stated(text, &["convention"]) {
        let read = name.to_lowercase().parse::<Convention>();
        let convention = read.map_err(|e| Fault::input(e).next("name a convention of docs/conventions.md"))?;
        match named.replace(convention) {
            Some(other) if other != convention => {
                return Err(Fault::input(format!(
                    "comments name two conventions, '{}' and '{}'",
                    other.name(),
                    convention.name()
                ))
                .cause("two files were joined, or a line of another file stayed")
                .next("keep the one in which the robot writes its poses"));
            }
            _ => {}
        }
    }
    Ok(named)
}

/// The unit of lengths that a table's comments state: only mm is accepted there.
///
/// # Errors
/// Another unit; `next` is the step to propose.
pub(super) fn stated_mm(text: &str, next: &str) -> Result<bool> {
    let values = stated(text, &["unit", "units"]);
    match values.iter().find(|value| unit(&value.to_lowercase()) != Some("mm")) {
        Some(value) => Err(Fault::input(format!("a comment states the unit '{value}', only 'mm' is read there"))
            .cause("lengths in another unit, or units of lengths and angles in one line")
            .next(next)),
        None => Ok(!values.is_empty()),
    }
}

/// Refuses poses whose comments state another layout or another transform than the one in `transforms`, which has
/// the same meaning in each of its spellings.
pub(super) fn check_statements(text: &str, transforms: &[&str]) -> Result<()> {
    for (key, says, read) in [
        ("transform", "a comment states the transform", transforms),
        ("layout", "a comment states the layout", &["row-major 4x4", "row-major"]),
    ] {
        let values = stated(text, &[key]);
        if let Some(other) = values.iter().find(|value| !read.contains(value)) {
            return Err(Fault::input(format!("{says} '{other}', only '{}' is read", read[0]))
                .cause("another program's convention: inverted poses, or those of a tool, a camera or a work frame")
                .next("convert the poses first; if they are right and the comment is not, correct the comment"));
        }
    }
    Ok(())
}

struct Header {
    convention: Convention,
    /// Whether the last column is Denso's figure.
    figure: bool,
    length_stated: bool,
    angle_stated: bool,
}

/// A unit in any of its spellings, converted to the spelling of the conventions' labels.
fn unit(word: &str) -> Option<&'static str> {
    match word {
        "mm" | "millimetre" | "millimetres" | "millimeter" | "millimeters" => Some("mm"),
        "m" | "metre" | "metres" | "meter" | "meters" => Some("m"),
        "deg" | "degree" | "degrees" | "°" => Some("deg"),
        "rad" | "radian" | "radians" => Some("rad"),
        _ => None,
    }
}

/// A column's name and unit: `RX_deg`, `rx [deg]` and `RX deg` all give `rx` in `deg`.
fn column(cell: &str) -> (String, Option<String>) {
    let lower = cell.to_lowercase();
    let mut words = lower.split(|c: char| !c.is_alphanumeric() && c != '°').filter(|w| !w.is_empty());
    let name = words.next().unwrap_or_default().to_owned();
    (name, words.next().map(str::to_owned))
}

impl Header {
    fn read(TableRow { text: line, cells, .. }: &TableRow, convention: Option<Convention>) -> Result<Header> {
        if cells.len() < 2 && line.contains([';', '\t']) {
            return Err(Fault::input("columns are separated by semicolons or tabs, only commas are read")
                .cause("exported by a spreadsheet whose numbers have decimal commas")
                .next("export with commas between columns and points in numbers"));
        }
        if cells.iter().all(|c| c.parse::<f64>().is_ok()) {
            return Err(Fault::input(format!("'{line}' contains numbers instead of column names"))
                .cause("the header line is missing")
                .next("put a header first, e.g. frame,X_mm,Y_mm,Z_mm,RX_deg,RY_deg,RZ_deg"));
        }
        let mut columns: Vec<_> = cells.iter().map(|c| column(c)).collect();
        let of_denso = matches!(convention, Some(Convention::Denso | Convention::DensoT));
        let figure = of_denso && columns.last().is_some_and(|(name, _)| matches!(name.as_str(), "fig" | "figure"));
        if figure {
            columns.pop();
        }
        let names = columns[1..].iter().map(|(name, _)| name.as_str());
        let matrix = names.clone().eq(Convention::Matrix.labels().iter().copied());
        let Some(convention) = convention.or(matrix.then_some(Convention::Matrix)) else {
            return Err(Fault::input("poses without a convention")
                .cause("six or seven numbers can be read in nine ways, and this program does not guess")
                .next("put a line '# convention: denso' (or ur, kuka, fanuc, abb, yaskawa, ros, quaternion) first"));
        };
        let wanted: Vec<_> = convention.labels().iter().map(|l| column(l)).collect();
        let layout = format!("frame,{}", convention.labels().join(",").replace(' ', "_"));
        let other = |what: String, cause: &str| {
            Err(Fault::input(what).cause(cause.to_owned()).next(format!(
                "name the file's convention, or order the columns as {} does: {layout}",
                convention.name()
            )))
        };
        if columns[0].0 != "frame" || !names.clone().eq(wanted.iter().map(|(name, _)| name.as_str())) {
            return other(
                format!("the columns are '{line}', a {} file has '{layout}'", convention.name()),
                "another convention than the one named, or columns in another order",
            );
        }
        for (k, ((_, is), (_, want))) in columns[1..].iter().zip(&wanted).enumerate() {
            if is.is_some() && is.as_deref().and_then(unit) != want.as_deref() {
                let want = want.as_deref().unwrap_or("no unit");
                let what = format!("column {} is '{}', {} has it in {want}", k + 2, cells[k + 1], convention.name());
                return other(what, "the numbers are in another unit than the convention's");
            }
        }
        let stated = |units: [&str; 2]| {
            let mut of =
                columns[1..].iter().zip(&wanted).filter(|(_, (_, w))| w.as_deref().is_some_and(|w| units.contains(&w)));
            of.clone().next().is_none() || of.all(|((_, is), _)| is.is_some())
        };
        Ok(Header { convention, figure, length_stated: stated(["mm", "m"]), angle_stated: stated(["deg", "rad"]) })
    }
}

fn row(TableRow { text: line, cells, .. }: &TableRow, header: &Header) -> Result<Row> {
    let wanted = header.convention.labels().len() + 1 + usize::from(header.figure);
    if cells.len() != wanted {
        let whole = |c: &String| c.parse::<i64>().is_ok();
        let cause = if line.contains(';') {
            "columns parted by semicolons, as spreadsheets export numbers with decimal commas"
        } else if cells.len() > wanted && cells.iter().all(whole) {
            "numbers with decimal commas"
        } else {
            "a truncated or edited file"
        };
        return Err(Fault::input(format!("'{line}' has {} columns, the header has {wanted}", cells.len()))
            .cause(cause)
            .next("export the poses again, with points in numbers"));
    }
    let numbers: std::result::Result<Vec<f64>, _> = cells.iter().map(|c| c.parse::<f64>()).collect();
    let commas = cells.iter().any(|c| c.contains(','));
    let bad = || {
        Fault::input(format!("'{line}' is not a row of numbers"))
            .cause(if commas { "numbers with decimal commas" } else { "a truncated or edited file" })
            .next("export the poses again")
    };
    let numbers = numbers.map_err(|_| bad())?;
    let index = Some(numbers[0]).filter(|c| c.fract() == 0.0 && (0.0..1e9).contains(c)).ok_or_else(bad)?;
    Ok((index as usize, header.convention, numbers[1..].to_vec()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(text: &str) -> String {
        read(text).err().map(|e| e.to_string()).unwrap_or_default()
    }

    #[test]
    fn columns_and_units_must_be_the_conventions() {
        let with = |convention: &str, header: &str| format!("# convention: {convention}\n{header}\n0,1,2,3,4,5,6\n");
        for good in [
            "frame,X,Y,Z,RX,RY,RZ",
            "frame,x_mm,y_mm,z_mm,rx_deg,ry_deg,rz_deg",
            "frame, X [mm],Y (mm),Z mm,RX °,RY deg,RZ degrees",
        ] {
            assert_eq!(said(&with("denso", good)), "", "{good}");
        }
        assert_eq!(said("# convention: denso\nframe,X,Y,Z,RX,RY,RZ,Fig\n0,1,2,3,4,5,6,5\n"), "");
        for (convention, header, want) in [
            ("denso", "frame,rx,ry,rz,x,y,z", "another order"),
            ("kuka", "frame,X,Y,Z,A,B,C,Fig", "another order"),
            ("denso", "frame,X_m,Y_m,Z_m,RX,RY,RZ", "column 2 is 'X_m', denso has it in mm"),
            ("kuka", "frame,X,Y,Z,A_rad,B_rad,C_rad", "column 5 is 'A_rad', kuka has it in deg"),
            ("kuka", "frame,X,Y,Z,C,B,A", "another order"),
            ("ur", "frame,X,Y,Z,RX_deg,RY_deg,RZ_deg", "ur has it in rad"),
            ("ur", "frame,X_mm,Y_mm,Z_mm,RX,RY,RZ", "ur has it in m"),
            ("fanuc", "frame,X,Y,Z,RX,RY,RZ", "a fanuc file has 'frame,X_mm,Y_mm,Z_mm,W_deg"),
            ("denso", "X,Y,Z,RX,RY,RZ", "a denso file has"),
            ("denso", "frame;X;Y;Z;RX;RY;RZ", "semicolons"),
            ("denso", "0,1,2,3,4,5,6", "header line is missing"),
            ("quaternion", "frame,x,y,z,qx,qy,qz,qw", "another order"),
        ] {
            let is = said(&with(convention, header));
            assert!(is.contains(want) && is.contains("next step"), "{convention} {header}: {is}");
        }
        assert!(
            said("# convention: denso\nframe,x,y,z,rx,ry,rz\n0,1,5,2,5,3,5,4,5,5,5,6,5\n").contains("decimal commas")
        );
        assert!(said("# convention: denso\nframe,x,y,z,rx,ry,rz\n0;1,5;2,5;3;4;5;6\n").contains("semicolons"));
        let quoted = "0,\"1,5\",\"2,5\",\"3,5\",\"4,5\",\"5,5\",\"6,5\"";
        assert!(said(&format!("# convention: denso\nframe,x,y,z,rx,ry,rz\n{quoted}\n")).contains("decimal commas"));
        assert!(said("\u{feff}# convention: denso\nframe,x,y,z,rx,ry,rz\n0,1,2,3,4,5,6\n").is_empty());
        assert!(said("frame,x,y,z,rx,ry,rz\n0,1,2,3,4,5,6\n").contains("without a convention"));
    }

    #[test]
    fn comments_are_honoured_or_refused() {
        let with = |comments: &str| said(&format!("{comments}\nframe,x,y,z,rx,ry,rz\n0,1,2,3,40,5,6\n"));
        for good in ["# Convention: DENSO", "#convention = denso", "# convention: denso\n# convention: denso"] {
            assert_eq!(with(good), "", "{good}");
        }
        let two = with("# convention: denso\n# convention: gba");
        assert!(two.contains("two conventions, 'denso' and 'gba'"), "{two}");
        // Also below the header.
        let late = said("# convention: denso\nframe,x,y,z,rx,ry,rz\n# convention: gba\n0,1,2,3,40,5,6\n");
        assert!(late.contains("two conventions"), "{late}");
        let transform = |comment: &str| check_statements(comment, &["base_T_flange", "base_from_flange"]);
        assert!(transform("# transform: base_T_flange\n# Transform = base_from_flange\n# made: today").is_ok());
        for other in ["flange_T_base", "base_T_tool", "base_T_camera"] {
            let said = transform(&format!("# TRANSFORM: {other}\n")).unwrap_err().what;
            assert!(said.contains(other) && said.contains("only 'base_T_flange' is read"), "{said}");
        }
        assert!(transform("# layout: column-major 4x4").is_err() && transform("# layout: row-major 4x4").is_ok());
    }
}
