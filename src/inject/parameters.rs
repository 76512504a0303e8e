//! Parameters of a cause: what it accepts, and the values given.

use anyhow::{Context, Result, bail, ensure};
use std::fmt;

/// Value of a parameter that is not given, and with it the parameter's type.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DefaultValue {
    /// A number.
    Number(f64),
    /// A number that may be left out; the text says what then holds.
    Optional(&'static str),
    /// 0 (no) or 1 (yes).
    Flag(bool),
    /// One of the words listed.
    Choice(&'static str, &'static [&'static str]),
    /// A name out of the block; the text says what holds without one.
    Name(&'static str),
    /// Numbers separated by `/`; the text says what holds without them.
    List(&'static str),
}

impl fmt::Display for DefaultValue {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            DefaultValue::Number(number) => write!(out, "{number}"),
            DefaultValue::Flag(flag) => write!(out, "{}", u8::from(*flag)),
            DefaultValue::Choice(word, choices) => write!(out, "{word} (of {})", choices.join("|")),
            DefaultValue::Optional(text) | DefaultValue::Name(text) | DefaultValue::List(text) => write!(out, "{text}"),
        }
    }
}

/// One parameter of a cause.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParameterSpec {
    /// Key on the command line.
    pub name: &'static str,
    /// Unit, empty where there is none.
    pub unit: &'static str,
    /// Type, and value when not given.
    pub default: DefaultValue,
    /// One line of help.
    pub help: &'static str,
}

/// Short form for the tables of the causes.
pub(super) const fn parameter(
    name: &'static str,
    unit: &'static str,
    default: DefaultValue,
    help: &'static str,
) -> ParameterSpec {
    ParameterSpec { name, unit, default, help }
}

/// Value of a parameter.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// A finite number.
    Number(f64),
    /// A word or a name.
    Word(String),
    /// Finite numbers.
    List(Vec<f64>),
    /// Not given, and without a default number.
    Absent,
}

impl fmt::Display for Value {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Value::Number(number) => write!(out, "{number}"),
            Value::Word(word) => write!(out, "{word}"),
            Value::List(list) => {
                write!(out, "{}", list.iter().map(f64::to_string).collect::<Vec<_>>().join("/"))
            }
            Value::Absent => Ok(()),
        }
    }
}

impl ParameterSpec {
    /// The default as a value.
    fn default_value(&self) -> Value {
        match self.default {
            DefaultValue::Number(number) => Value::Number(number),
            DefaultValue::Flag(flag) => Value::Number(f64::from(u8::from(flag))),
            DefaultValue::Choice(word, _) => Value::Word(word.to_owned()),
            DefaultValue::Optional(_) | DefaultValue::Name(_) | DefaultValue::List(_) => Value::Absent,
        }
    }

    /// Reads a value of the parameter's type.
    fn read(&self, text: &str) -> Result<Value> {
        let number = |text: &str| -> Result<f64> {
            let number: f64 = text.trim().parse().map_err(|_| anyhow::anyhow!("`{text}` is not a number"))?;
            ensure!(number.is_finite(), "`{text}` is not a finite number");
            Ok(number)
        };
        Ok(match self.default {
            DefaultValue::Number(_) | DefaultValue::Optional(_) => Value::Number(number(text)?),
            DefaultValue::Flag(_) => match text {
                "0" => Value::Number(0.0),
                "1" => Value::Number(1.0),
                _ => bail!("`{text}` is neither 0 nor 1"),
            },
            DefaultValue::Choice(_, choices) => {
                ensure!(choices.contains(&text), "`{text}` is none of {}", choices.join(", "));
                Value::Word(text.to_owned())
            }
            DefaultValue::Name(_) => Value::Word(text.to_owned()),
            DefaultValue::List(_) => Value::List(text.split('/').map(number).collect::<Result<_>>()?),
        })
    }
}

/// The values of all parameters of one cause, in the order of its table.
#[derive(Debug, Clone, PartialEq)]
pub struct Values(Vec<(&'static str, Value)>);

impl Values {
    /// The defaults.
    pub fn defaults(specs: &'static [ParameterSpec]) -> Self {
        Self(specs.iter().map(|spec| (spec.name, spec.default_value())).collect())
    }

    /// Sets a parameter from text.
    ///
    /// # Errors
    /// A key that the table does not have, or text that is no value of its type.
    pub fn set(&mut self, specs: &'static [ParameterSpec], key: &str, text: &str) -> Result<()> {
        let Some(index) = specs.iter().position(|spec| spec.name == key) else {
            let keys: Vec<_> = specs.iter().map(|spec| spec.name).collect();
            let keys = if keys.is_empty() { "none".into() } else { keys.join(", ") };
            bail!("no parameter `{key}`; it has {keys}");
        };
        self.0[index].1 = specs[index].read(text).with_context(|| format!("parameter `{key}`"))?;
        Ok(())
    }

    /// Names and values.
    pub fn iter(&self) -> impl Iterator<Item = (&'static str, &Value)> {
        self.0.iter().map(|(name, value)| (*name, value))
    }

    fn get(&self, name: &str) -> &Value {
        // Names are literals of the cause that declares them; a test prepares every cause.
        self.0.iter().find(|(key, _)| *key == name).map_or(&Value::Absent, |(_, value)| value)
    }

    /// A number with a default.
    pub(super) fn number(&self, name: &str) -> f64 {
        self.optional(name).unwrap_or(f64::NAN)
    }

    /// A number that must not be negative.
    pub(super) fn size(&self, name: &str) -> Result<f64> {
        let number = self.number(name);
        ensure!(number >= 0.0, "parameter `{name}` must not be negative, it is {number}");
        Ok(number)
    }

    /// A number that must be positive.
    pub(super) fn positive(&self, name: &str) -> Result<f64> {
        let number = self.number(name);
        ensure!(number > 0.0, "parameter `{name}` must be positive, it is {number}");
        Ok(number)
    }

    /// A number that may be absent.
    pub(super) fn optional(&self, name: &str) -> Option<f64> {
        match self.get(name) {
            Value::Number(number) => Some(*number),
            _ => None,
        }
    }

    /// A yes or no.
    pub(super) fn flag(&self, name: &str) -> bool {
        self.number(name) == 1.0
    }

    /// A word; empty when absent.
    pub(super) fn word(&self, name: &str) -> &str {
        match self.get(name) {
            Value::Word(word) => word,
            _ => "",
        }
    }

    /// A list that may be absent.
    pub(super) fn list(&self, name: &str) -> Option<&[f64]> {
        match self.get(name) {
            Value::List(list) => Some(list),
            _ => None,
        }
    }
}
