//! In: a FANUC teach-pendant listing (.LS). Out: its Cartesian positions by number.
//! Frame and unit: the user frame that the listing names, mm and degrees: R = Rz(R)·Ry(P)·Rx(W).

use super::Convention;
use crate::fault::{Fault, Result};
use crate::geometry::{Frame, Rigid};

/// One position of a program.
#[derive(Clone, Debug)]
pub struct TpPosition<To: Frame, From: Frame> {
    /// n of `P[n]`.
    pub number: u32,
    /// The comment, empty if there is none: P[3:"over the ball"].
    pub comment: String,
    /// Number of the user frame, n of `UF : n`.
    pub user_frame: u32,
    /// Number of the tool frame, n of `UT : n`.
    pub tool_frame: u32,
    /// The tool frame in the user frame, mm.
    pub pose: Rigid<To, From>,
}

/// Reads every position of a listing, ascending by number. Returns an error for joint positions, positions that
/// were never taught (asterisks), a missing unit and duplicate numbers.
pub fn read<To: Frame, From: Frame>(text: &str) -> Result<Vec<TpPosition<To, From>>> {
    // Only the position section is read, because comments in the program may look like positions.
    let section = text.find("/POS").map_or(text, |at| &text[at + 4..]);
    let section = section.find("/END").map_or(section, |at| &section[..at]);
    let mut out: Vec<TpPosition<To, From>> = Vec::new();
    let mut rest = section;
    while let Some(at) = rest.find("P[") {
        let after = &rest[at + 2..];
        let (Some(close), Some(open)) = (after.find(']'), after.find('{')) else {
            return Err(bad("a position is cut off".into()));
        };
        let end = after.find("};").or_else(|| after.find('}')).ok_or_else(|| bad("a position is cut off".into()))?;
        if !(close < open && open < end) {
            let begins: String = after[..close].chars().take(12).collect();
            return Err(bad(format!("P[{begins}: brackets do not match")));
        }
        let position: TpPosition<To, From> = position(&after[..close], &after[open + 1..end])?;
        rest = &after[end + 1..];
        if out.iter().any(|p| p.number == position.number) {
            return Err(bad(format!("P[{}] is there twice", position.number)));
        }
        out.push(position);
    }
    if out.is_empty() {
        return Err(bad("no position P[n] was found".into()));
    }
    out.sort_by_key(|p| p.number);
    let first = (out[0].user_frame, out[0].tool_frame);
    if let Some(p) = out.iter().find(|p| (p.user_frame, p.tool_frame) != first) {
        return Err(bad(format!(
            "P[{}] is in UF {} UT {}, P[{}] in UF {} UT {}",
            p.number, p.user_frame, p.tool_frame, out[0].number, first.0, first.1
        )));
    }
    Ok(out)
}

fn bad(what: String) -> Fault {
    Fault::input(what)
        .cause("the listing holds something else than taught Cartesian positions")
        .next("touch up the positions as Cartesian ones and export the program as .LS again")
}

/// One position, from the text in its brackets and the text in its braces.
fn position<To: Frame, From: Frame>(head: &str, body: &str) -> Result<TpPosition<To, From>> {
    let (number, comment) = head.split_once(':').unwrap_or((head, ""));
    let number: u32 = number.trim().parse().map_err(|_| bad(format!("P[{number}]: is not a position number")))?;
    // Further motion groups (a positioner) follow the robot's group.
    let group = body.find("GP2").map_or(body, |g| &body[..g]);
    if body.contains('*') {
        return Err(bad(format!("P[{number}]: was never taught (asterisks)")));
    }
    let frame = |key: &str| -> u32 {
        group
            .split([',', '\n'])
            .filter_map(|f| f.split_once(':'))
            .find(|(k, _)| k.trim() == key)
            .and_then(|(_, v)| v.trim().parse().ok())
            .unwrap_or(0)
    };
    Ok(TpPosition {
        number,
        comment: comment.trim().trim_matches('"').to_owned(),
        user_frame: frame("UF"),
        tool_frame: frame("UT"),
        pose: Convention::Fanuc.read(&numbers(number, group)?).map_err(|e| e.at(format!("P[{number}]")))?,
    })
}

/// X Y Z in mm and W P R in degrees of a position's motion group.
fn numbers(number: u32, group: &str) -> Result<Vec<f64>> {
    let fields: Vec<(&str, &str)> =
        group.split([',', '\n']).filter_map(|f| f.split_once('=')).map(|(k, v)| (k.trim(), v.trim())).collect();
    if fields.iter().any(|(k, _)| *k == "J1") {
        return Err(bad(format!("P[{number}]: holds joint angles")));
    }
    [("X", "mm"), ("Y", "mm"), ("Z", "mm"), ("W", "deg"), ("P", "deg"), ("R", "deg")]
        .iter()
        .map(|(key, unit)| {
            let value =
                fields.iter().find(|(k, _)| k == key).ok_or_else(|| bad(format!("P[{number}]: has no {key}")))?.1;
            let digits = value
                .strip_suffix(unit)
                .ok_or_else(|| bad(format!("P[{number}]: {key} = {value} is not in {unit}")))?;
            digits.trim().parse::<f64>().map_err(|_| bad(format!("P[{number}]: {key} = {value} is not a number")))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Base, Flange};

    const LISTING: &str = "/PROG  BALL\n/MN\n   1:J P[1] 100% FINE    ;\n   2:  !X = 3 ;\n/POS\nP[1]{\n   GP1:\n\tUF \
                           : 0, UT : 1,\t\tCONFIG : 'N U T, 0, 0, 0',\n\tX =   500.125  mm,\tY =   -20.500  mm,\tZ \
                           =   300.000  mm,\n\tW =   180.000 deg,\tP =    10.000 deg,\tR =   -90.000 \
                           deg\n};\nP[2:\"over the ball\"]{\n   GP1:\n\tUF : 0, UT : 1,\t\tCONFIG : 'N U T, 0, 0, \
                           0',\n\tX =  1.0  mm,\tY =  2.0  mm,\tZ =  3.0  mm,\n\tW =  0.0 deg,\tP =  0.0 deg,\tR =  \
                           90.0 deg\n};\n/END\n";

    #[test]
    fn positions_are_read_with_comment_and_frames() {
        let p = read::<Base, Flange>(LISTING).unwrap();
        assert_eq!((p.len(), p[0].number, p[0].tool_frame, p[1].comment.as_str()), (2, 1, 1, "over the ball"));
        assert_eq!(p[0].pose.translation.x, 500.125);
        // Rz(90): the flange's x axis is the base's y axis.
        assert!((p[1].pose.rotation[(1, 0)] - 1.0).abs() < 1e-12);
        let numbers = Convention::Fanuc.write(&p[0].pose);
        assert!((numbers[4] - 10.0).abs() < 1e-9 && (numbers[5] + 90.0).abs() < 1e-9);
    }

    #[test]
    fn what_cannot_be_used_is_named() {
        let not = |from: &str, to: &str| read::<Base, Flange>(&LISTING.replacen(from, to, 1)).unwrap_err().what;
        assert!(not("500.125", "********").contains("never taught"));
        assert!(not("500.125  mm", "500.125  in").contains("not in mm"));
        assert!(not("X =   500.125  mm", "J1=  5.0 deg").contains("joint"));
        assert!(not("P[2:\"over the ball\"]", "P[1]").contains("twice"));
        assert!(not("UT : 1", "UT : 2").contains("UT"));
        assert!(read::<Base, Flange>("/PROG\n/MN\n/POS\n/END").is_err());
    }
}
