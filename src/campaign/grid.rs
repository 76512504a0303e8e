//! A grid: what every case has, and the factors whose levels are combined.
//!
//! ```toml
//! about = "power of the rolling shutter"
//! [case]                                   # a recipe (`inject::recipe`), in which {name} stands for a level
//! seed = "{seed}"
//! causes = ["rolling-shutter:readout={readout}"]
//! expected = ["rolling-shutter"]           # what a diagnosis should name; absent: nothing
//! scenario = { preset = "{preset}", set = { points = 400 } }
//! noise = { px = 0.3, stated_px = 0.3 }
//! model = { datum = "all" }                # free, fix, tie, datum, significance
//! [factors]
//! seed = "1..200"                          # whole numbers from the first to the last
//! readout = [0.001, 0.002, 0.004]          # levels
//! preset = ["dike", "mapping"]
//! control = { choose = 4, of = ["a", "b", "c", "d", "e"] }     # every four
//! [[factors.error]]                        # levels of several values: {error.cause}, {error.effect}; {error}: the name
//! name = "flaw"
//! cause = "local-flaw"
//! effect = "local-flaw"
//! ```
//!
//! A text that is a placeholder alone becomes the level as it is, a number or a list; elsewhere its text. An empty text
//! in a list is left out, so that a level may mean *no error*.

use anyhow::{Context, Result, bail, ensure};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use toml::{Table, Value};

/// Cases of a campaign, at the most: a plan of more is a slip of the pen.
const MOST_CASES: usize = 1_000_000;
/// Characters of an id: 64 bits, so that two of a million cases share one with a probability of 3e-8. Planning looks.
const ID_CHARACTERS: usize = 16;
/// Key of the name of a level of several values.
const NAME: &str = "name";

/// A grid as it is written down.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Grid {
    /// One sentence for people.
    #[serde(default)]
    pub about: String,
    /// What every case has.
    pub case: Table,
    /// Levels by factor.
    #[serde(default)]
    pub factors: Table,
}

/// A case of a plan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Planned {
    /// Hash of `case`.
    pub id: String,
    /// Names of the levels, by factor.
    pub factors: BTreeMap<String, String>,
    /// The case, see [`super::Case`].
    pub case: serde_json::Value,
}

/// A level: its name in tables, and the values of its placeholders.
struct Level {
    name: String,
    values: BTreeMap<String, Value>,
}

/// Reads a grid.
///
/// # Errors
/// A file that cannot be read or is no grid, with line and column.
pub fn read(path: &Path) -> Result<Grid> {
    let text = crate::files::read_text(path).with_context(|| format!("cannot read the grid {}", path.display()))?;
    toml::from_str(&text).with_context(|| format!("{}", path.display()))
}

impl Grid {
    /// All cases, in the order of their factors' names and levels.
    ///
    /// # Errors
    /// A factor without levels, or one that no case depends on; a placeholder that is no factor; too many cases.
    pub fn cases(&self) -> Result<Vec<Planned>> {
        let levels = self.factors.iter().map(|(factor, value)| {
            let levels = levels(factor, value).with_context(|| format!("factor `{factor}`"))?;
            ensure!(!levels.is_empty(), "factor `{factor}` has no level");
            Ok((factor, levels))
        });
        let factors: Vec<(&String, Vec<Level>)> = levels.collect::<Result<_>>()?;
        let count = factors.iter().try_fold(1_usize, |all, (_, levels)| all.checked_mul(levels.len()));
        let count = count.filter(|count| *count <= MOST_CASES);
        let Some(count) = count else { bail!("the factors give more than {MOST_CASES} cases") };
        let mut used = BTreeSet::new();
        let mut cases = Vec::with_capacity(count);
        for number in 0..count {
            let mut rest = number;
            let mut chosen: Vec<(&String, &Level)> = Vec::new();
            for (factor, levels) in factors.iter().rev() {
                chosen.push((*factor, &levels[rest % levels.len()]));
                rest /= levels.len();
            }
            let values = chosen.iter().flat_map(|(_, level)| level.values.iter()).collect();
            let case = filled(&Value::Table(self.case.clone()), &values, &mut used)?;
            let case = serde_json::to_value(case)?;
            let factors = chosen.iter().map(|(factor, level)| ((*factor).clone(), level.name.clone())).collect();
            cases.push(Planned { id: id_of(&case), factors, case });
        }
        let unused = factors.iter().find(|(factor, _)| {
            let of_factor = |name: &&String| *name == *factor || name.starts_with(&format!("{factor}."));
            !used.iter().any(|name| of_factor(&name))
        });
        if let Some((factor, _)) = unused {
            bail!("factor `{factor}`: no {{{factor}}} stands in [case], so every level would be the same case");
        }
        let mut ids = BTreeSet::new();
        let twice = cases.iter().find(|case| !ids.insert(case.id.as_str()));
        if let Some(twice) = twice {
            bail!("two combinations of levels are the same case, the second {:?}", twice.factors);
        }
        Ok(cases)
    }
}

fn id_of(case: &serde_json::Value) -> String {
    let hash = Sha256::digest(case.to_string());
    hash.iter().map(|byte| format!("{byte:02x}")).collect::<String>()[..ID_CHARACTERS].to_owned()
}

fn levels(factor: &str, value: &Value) -> Result<Vec<Level>> {
    let plain = |name: String, value: Value| Level { name, values: [(factor.to_owned(), value)].into() };
    match value {
        Value::String(text) => {
            let range = text.split_once("..").and_then(|(a, b)| Some((a.trim().parse().ok()?, b.trim().parse().ok()?)));
            let Some((first, last)) = range else { bail!("`{text}`: expected whole numbers as \"1..200\", or a list") };
            let numbers = first..=last;
            ensure!(last - first < MOST_CASES as i64, "`{text}` has more than {MOST_CASES} levels");
            Ok(numbers.map(|number: i64| plain(number.to_string(), Value::Integer(number))).collect())
        }
        Value::Array(all) => all.iter().map(|value| level(factor, value)).collect(),
        Value::Table(choice) => {
            let Choice { choose, of } = choice.clone().try_into().context("expected { choose = k, of = [names] }")?;
            let choices = choices(&of, choose)?;
            Ok(choices
                .into_iter()
                .map(|names| plain(names.join("+"), Value::Array(names.into_iter().map(Value::String).collect())))
                .collect())
        }
        _ => bail!("expected a list of levels, \"1..200\", or {{ choose = k, of = [names] }}"),
    }
}

fn level(factor: &str, value: &Value) -> Result<Level> {
    let Value::Table(table) = value else {
        return Ok(Level { name: text(value)?, values: [(factor.to_owned(), value.clone())].into() });
    };
    let Some(Value::String(name)) = table.get(NAME) else { bail!("a level of several values needs a `name`") };
    let mut values: BTreeMap<String, Value> =
        table.iter().map(|(key, value)| (format!("{factor}.{key}"), value.clone())).collect();
    values.insert(factor.to_owned(), Value::String(name.clone()));
    Ok(Level { name: name.clone(), values })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Choice {
    choose: usize,
    of: Vec<String>,
}

/// Every choice of `count` names, in their order.
fn choices(names: &[String], count: usize) -> Result<Vec<Vec<String>>> {
    ensure!(count >= 1 && count <= names.len(), "{count} of {} names cannot be chosen", names.len());
    let ways = (0..count).try_fold(1_usize, |ways, k| Some(ways.checked_mul(names.len() - k)? / (k + 1)));
    ensure!(ways.is_some_and(|ways| ways <= MOST_CASES), "more than {MOST_CASES} choices");
    let mut chosen: Vec<usize> = (0..count).collect();
    let mut all = Vec::new();
    loop {
        all.push(chosen.iter().map(|k| names[*k].clone()).collect());
        // The last one that can go on, goes on; those behind it follow it.
        let Some(position) = (0..count).rev().find(|k| chosen[*k] < names.len() - count + k) else { return Ok(all) };
        chosen[position] += 1;
        for k in position + 1..count {
            chosen[k] = chosen[k - 1] + 1;
        }
    }
}

/// A value with its placeholders filled; `used`: their names.
fn filled(value: &Value, levels: &BTreeMap<&String, &Value>, used: &mut BTreeSet<String>) -> Result<Value> {
    let mut find = |name: &str| -> Result<&Value> {
        let known = || levels.keys().map(|name| name.as_str()).collect::<Vec<_>>().join(", ");
        let found = levels.get(&name.to_owned()).copied();
        let found = found.with_context(|| format!("[case]: {{{name}}} is no factor; there are: {}", known()))?;
        used.insert(name.to_owned());
        Ok(found)
    };
    match value {
        Value::String(template) => {
            let alone = template.strip_prefix('{').and_then(|rest| rest.strip_suffix('}'));
            if let Some(name) = alone.filter(|name| !name.contains(['{', '}'])) {
                return find(name).cloned();
            }
            let mut out = String::new();
            let mut rest = template.as_str();
            while let Some((before, behind)) = rest.split_once('{') {
                let Some((name, behind)) = behind.split_once('}') else { bail!("[case]: `{template}` lacks a }}") };
                out += before;
                out += &text(find(name)?).with_context(|| format!("[case]: `{template}`"))?;
                rest = behind;
            }
            Ok(Value::String(out + rest))
        }
        Value::Array(values) => {
            let values = values.iter().map(|value| filled(value, levels, used)).collect::<Result<Vec<_>>>()?;
            let is_empty = |value: &Value| value.as_str() == Some("");
            Ok(Value::Array(values.into_iter().filter(|value| !is_empty(value)).collect()))
        }
        Value::Table(table) => {
            let filled = |(key, value): (&String, &Value)| Ok((key.clone(), filled(value, levels, used)?));
            Ok(Value::Table(table.iter().map(filled).collect::<Result<Table>>()?))
        }
        _ => Ok(value.clone()),
    }
}

/// A level as text, within another one and in tables.
fn text(value: &Value) -> Result<String> {
    Ok(match value {
        Value::String(text) => text.clone(),
        Value::Integer(number) => number.to_string(),
        Value::Float(number) => number.to_string(),
        Value::Boolean(value) => value.to_string(),
        Value::Array(values) => values.iter().map(text).collect::<Result<Vec<_>>>()?.join("+"),
        Value::Datetime(_) | Value::Table(_) => bail!("expected texts, numbers, or lists of them"),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(text: &str) -> Result<Vec<Planned>> {
        toml::from_str::<Grid>(text).expect("a grid").cases()
    }

    #[test]
    fn levels_are_combined_and_take_their_places() {
        let cases = grid(
            r#"
            [case]
            seed = "{seed}"
            causes = ["{error.cause}", "noise:px={px}"]
            expected = ["{error.effect}"]
            control = "{control}"
            [factors]
            seed = "1..3"
            px = [0.3, 1]
            control = { choose = 2, of = ["a", "b", "c"] }
            [[factors.error]]
            name = "none"
            cause = ""
            effect = ""
            [[factors.error]]
            name = "flaw"
            cause = "local-flaw:lambda=2"
            effect = "local-flaw"
            "#,
        )
        .expect("cases");
        assert_eq!(cases.len(), 3 * 2 * 3 * 2);
        let last = cases.last().expect("cases");
        assert_eq!(
            last.case.to_string(),
            r#"{"causes":["local-flaw:lambda=2","noise:px=1"],"control":["b","c"],"expected":["local-flaw"],"seed":3}"#
        );
        let names: Vec<&str> = last.factors.values().map(String::as_str).collect();
        assert_eq!(names, ["b+c", "flaw", "1", "3"]);
        assert_eq!(cases[0].case["expected"], serde_json::json!([]), "an empty text is left out");
        // The hash of what stands above: an id that changes makes every result of a campaign unknown.
        assert_eq!(last.id.len(), ID_CHARACTERS);
        assert_eq!(last.id, id_of(&serde_json::from_str(&last.case.to_string()).expect("JSON")));
    }

    #[test]
    fn choices_are_all_there() {
        let names: Vec<String> = (0..7).map(|k| k.to_string()).collect();
        let all = choices(&names, 3).expect("choices");
        let different: BTreeSet<&Vec<String>> = all.iter().collect();
        assert_eq!((all.len(), different.len()), (35, 35));
        assert!(choices(&names, 8).is_err() && choices(&names, 0).is_err());
    }

    #[test]
    fn what_cannot_be_meant_is_refused() {
        let refused = |text: &str| format!("{:#}", grid(text).expect_err("refused"));
        assert!(refused("case = { seed = 1 }\nfactors = { px = [1] }").contains("no {px} stands in [case]"));
        assert!(refused("case = { seed = \"{sed}\" }\nfactors = { seed = [1] }").contains("{sed} is no factor"));
        assert!(refused("case = { seed = \"{seed}\" }\nfactors = { seed = [] }").contains("has no level"));
        assert!(refused("case = { seed = \"{seed}\" }\nfactors = { seed = [1, 1] }").contains("the same case"));
        let many = "case = { a = \"{a}\", b = \"{b}\" }\nfactors = { a = \"1..2000\", b = \"1..2000\" }";
        assert!(refused(many).contains("more than 1000000 cases"));
    }
}
