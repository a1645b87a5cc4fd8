//! In: arguments of a method. Out: what they say, or that they are wrong; parts of lists. Pure.
//! Frame and unit: mm.

use crate::model::data::{RecipeIdExternal, RecipeIdInternal};
use opcua::types::{StatusCode, TryFromVariant, Variant, VariantScalarTypeId};
use sheetlight_registers::Ask;

/// Most characters of an identifier that a client gives to a job.
pub const MOST_LETTERS: usize = 100;
/// Most parameters of a job.
const MOST_PARAMETERS: usize = 8;

/// An argument that is a structure: null and missing are nothing.
pub fn structure<T: Clone + Send + Sync + 'static>(arguments: &[Variant], at: usize) -> Result<Option<T>, StatusCode> {
    match arguments.get(at) {
        None | Some(Variant::Empty) => Ok(None),
        Some(Variant::ExtensionObject(o)) if o.is_null() => Ok(None),
        Some(Variant::ExtensionObject(o)) => o.inner_as::<T>().cloned().map(Some).ok_or(StatusCode::BadInvalidArgument),
        Some(_) => Err(StatusCode::BadInvalidArgument),
    }
}

/// A number; null and missing are 0.
pub fn number<T: TryFromVariant + Default>(arguments: &[Variant], at: usize) -> Result<T, StatusCode> {
    match arguments.get(at) {
        None | Some(Variant::Empty) => Ok(T::default()),
        Some(v) => T::try_from_variant(v.clone()).map_err(|_| StatusCode::BadInvalidArgument),
    }
}

/// The words of an array of parameters.
pub fn words(arguments: &[Variant], at: usize) -> Result<Vec<String>, StatusCode> {
    let values = match arguments.get(at) {
        None | Some(Variant::Empty) => vec![],
        Some(Variant::Array(array)) => array.values.clone(),
        Some(other) => vec![other.clone()],
    };
    if values.len() > MOST_PARAMETERS {
        return Err(StatusCode::BadInvalidArgument);
    }
    let word = |v: Variant| match v {
        Variant::String(s) => Ok(s.as_ref().to_owned()),
        Variant::Variant(inner) => match *inner {
            Variant::String(s) => Ok(s.as_ref().to_owned()),
            _ => Err(StatusCode::BadInvalidArgument),
        },
        _ => Err(StatusCode::BadInvalidArgument),
    };
    values.into_iter().map(word).collect()
}

/// Options of a job: the texts "insert", "find", "scan" and "sweep_mm=30".
pub fn request(recipe: &str, parameters: &[String]) -> Result<Ask, StatusCode> {
    let (mut word, mut sweep_mm) = ("insert", None);
    for text in parameters {
        match text.split_once('=') {
            None if ["insert", "find", "scan"].contains(&text.as_str()) => word = text,
            Some(("sweep_mm", mm)) => {
                let mm: f64 = mm.parse().map_err(|_| StatusCode::BadInvalidArgument)?;
                if !mm.is_finite() {
                    return Err(StatusCode::BadInvalidArgument);
                }
                sweep_mm = Some(mm);
            }
            _ => return Err(StatusCode::BadInvalidArgument),
        }
    }
    Ok(match word {
        "find" => Ask::Find(recipe.into()),
        "scan" => Ask::Scan(None),
        _ => Ask::Insert(recipe.into(), sweep_mm),
    })
}

/// The name in one of both identifiers of a recipe; the internal one counts first [opc-mv, 7.5.2.2].
pub fn recipe(external: Option<&RecipeIdExternal>, internal: Option<&RecipeIdInternal>) -> String {
    let given = |id: &str| (!id.is_empty()).then(|| id.to_owned());
    let internal = internal.and_then(|r| given(r.id.as_ref()));
    internal.or_else(|| external.and_then(|r| given(r.id.as_ref()))).unwrap_or_default()
}

/// A foreign text, cut, in plain characters.
pub fn plain(text: &str) -> String {
    text.chars().take(40).map(|c| if c.is_ascii_graphic() || c == ' ' { c } else { '?' }).collect()
}

/// A part of a list: at most `most` (0: all) from `from` on, and whether it goes to the end.
pub fn page<T>(all: Vec<T>, most: usize, from: usize) -> (bool, Vec<T>) {
    let count = all.len();
    let most = if most == 0 { count } else { most };
    let part: Vec<T> = all.into_iter().skip(from).take(most).collect();
    (from.saturating_add(part.len()) >= count, part)
}

pub fn listed(complete: bool, list: Vec<Variant>) -> Vec<Variant> {
    let count = list.len() as u32;
    let list = Variant::from((VariantScalarTypeId::ExtensionObject, list));
    vec![complete.into(), count.into(), 0u32.into(), list, 0i32.into()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parameters_are_words_of_this_program() {
        let of = |all: &[&str]| request("led", &all.iter().map(|w| (*w).to_owned()).collect::<Vec<_>>());
        assert_eq!(of(&[]), Ok(Ask::Insert("led".into(), None)));
        assert_eq!(of(&["sweep_mm=30.5", "insert"]), Ok(Ask::Insert("led".into(), Some(30.5))));
        assert_eq!(of(&["find"]), Ok(Ask::Find("led".into())));
        assert_eq!(of(&["scan"]), Ok(Ask::Scan(None)));
        for bad in ["dance", "sweep_mm=", "sweep_mm=inf", "=", ""] {
            assert_eq!(of(&[bad]), Err(StatusCode::BadInvalidArgument), "{bad}");
        }
    }

    #[test]
    fn arrays_of_words_come_in_two_forms() {
        let words_of = |v: Variant| words(&[v], 0);
        let plain = Variant::from(vec!["find".to_owned()]);
        let boxed = Variant::from((VariantScalarTypeId::Variant, vec![Variant::Variant(Box::new("find".into()))]));
        assert_eq!((words_of(plain), words_of(boxed)), (Ok(vec!["find".into()]), Ok(vec!["find".into()])));
        assert_eq!(words(&[], 0), Ok(vec![]));
        assert!(words_of(Variant::from(vec![1.0])).is_err() && words_of(Variant::from(vec![""; 9])).is_err());
    }

    #[test]
    fn lists_come_in_parts() {
        assert_eq!(page(vec![1, 2, 3], 0, 0), (true, vec![1, 2, 3]));
        assert_eq!(page(vec![1, 2, 3], 2, 0), (false, vec![1, 2]));
        assert_eq!(page(vec![1, 2, 3], 2, 1), (true, vec![2, 3]));
        assert_eq!(page(vec![1, 2, 3], 2, usize::MAX), (true, vec![]));
        assert_eq!(plain("a\u{7}b\u{8d64}"), "a?b?");
    }
}
