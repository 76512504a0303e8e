//! An expression as a person writes it, turned into C++ for any number type. Every name is looked up: nothing of the
//! text reaches the compiler unread.

/// Characters of an expression at most.
const LONGEST: usize = 4000;
/// Parentheses and signs within each other at most: the parser calls itself.
const DEEPEST: usize = 100;
/// Functions of one argument, the same in C++ and for numbers that carry derivatives.
const FUNCTIONS: [&str; 13] =
    ["sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "exp", "log", "sqrt", "abs"];
/// Functions of two arguments.
const OF_TWO: [&str; 2] = ["atan2", "hypot"];

/// Why an expression has no meaning; columns count from 1.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{text}`, character {column}: {problem}")]
pub struct ExpressionError {
    /// The expression.
    pub text: String,
    /// Where in it.
    pub column: usize,
    /// What is wrong there, and what was expected.
    pub problem: String,
}

/// An expression in C++.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Translated {
    /// Its text, in parentheses where it has several terms.
    pub cpp: String,
    /// The functions that it calls.
    pub functions: Vec<&'static str>,
}

/// Translates `text`; `name` gives the C++ text of a name, or says what is wrong with it. Operators are `+ - * / ^`
/// (also `**`), and `pi` is the number.
///
/// # Errors
/// [`ExpressionError`].
pub fn translate(
    text: &str,
    name: &mut dyn FnMut(&str) -> Result<String, String>,
) -> Result<Translated, ExpressionError> {
    let mut parser = Parser { text: text.chars().collect(), at: 0, depth: 0, functions: Vec::new(), name };
    if parser.text.len() > LONGEST {
        return Err(parser.refuse(0, format!("expected at most {LONGEST} characters")));
    }
    let cpp = parser.sum()?;
    match parser.peek() {
        None => Ok(Translated { cpp, functions: parser.functions }),
        Some(c) => Err(parser.refuse(parser.at, format!("expected an operator or the end, found `{c}`"))),
    }
}

struct Parser<'a> {
    text: Vec<char>,
    at: usize,
    depth: usize,
    functions: Vec<&'static str>,
    name: &'a mut dyn FnMut(&str) -> Result<String, String>,
}

type Parsed = Result<String, ExpressionError>;

impl Parser<'_> {
    fn refuse(&self, at: usize, problem: impl Into<String>) -> ExpressionError {
        ExpressionError { text: self.text.iter().collect(), column: at + 1, problem: problem.into() }
    }

    /// The next character that is no blank.
    fn peek(&mut self) -> Option<char> {
        while self.text.get(self.at).is_some_and(|c| c.is_whitespace()) {
            self.at += 1;
        }
        self.text.get(self.at).copied()
    }

    fn take(&mut self, wanted: char) -> bool {
        let found = self.peek() == Some(wanted);
        self.at += usize::from(found);
        found
    }

    fn power_sign(&mut self) -> bool {
        if self.peek() == Some('*') && self.text.get(self.at + 1) == Some(&'*') {
            self.at += 2;
            return true;
        }
        self.take('^')
    }

    fn sum(&mut self) -> Parsed {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(self.refuse(self.at, format!("expected at most {DEEPEST} levels of parentheses and signs")));
        }
        let mut text = self.product()?;
        while let Some(sign @ ('+' | '-')) = self.peek() {
            self.at += 1;
            text = format!("({text} {sign} {})", self.product()?);
        }
        self.depth -= 1;
        Ok(text)
    }

    fn product(&mut self) -> Parsed {
        let mut text = self.signed()?;
        while let Some(sign @ ('*' | '/')) = self.peek() {
            self.at += 1;
            text = format!("({text} {sign} {})", self.signed()?);
        }
        Ok(text)
    }

    /// A sign binds less than a power: `-x^2` is `-(x^2)`.
    fn signed(&mut self) -> Parsed {
        let mut negative = false;
        while let Some(sign @ ('+' | '-')) = self.peek() {
            negative ^= sign == '-';
            self.at += 1;
        }
        let power = self.power()?;
        Ok(if negative { format!("(-{power})") } else { power })
    }

    /// Powers group from the right: `x^2^3` is `x^(2^3)`.
    fn power(&mut self) -> Parsed {
        let base = self.atom()?;
        if !self.power_sign() {
            return Ok(base);
        }
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(self.refuse(self.at, format!("expected at most {DEEPEST} powers within each other")));
        }
        let exponent = self.signed()?;
        self.depth -= 1;
        self.call("pow");
        Ok(format!("pow({base}, {exponent})"))
    }

    fn call(&mut self, function: &'static str) {
        if !self.functions.contains(&function) {
            self.functions.push(function);
        }
    }

    fn atom(&mut self) -> Parsed {
        match self.peek() {
            Some('(') => {
                self.at += 1;
                let inner = self.sum()?;
                self.close()?;
                Ok(inner)
            }
            Some(c) if c.is_ascii_digit() || c == '.' => self.number(),
            Some(c) if c.is_ascii_alphabetic() || c == '_' => self.word(),
            Some(c) => Err(self.refuse(self.at, format!("expected a number, a name or `(`, found `{c}`"))),
            None => Err(self.refuse(self.at, "expected a number, a name or `(`, found the end")),
        }
    }

    fn close(&mut self) -> Result<(), ExpressionError> {
        if self.take(')') { Ok(()) } else { Err(self.refuse(self.at, "expected `)`")) }
    }

    fn number(&mut self) -> Parsed {
        let start = self.at;
        let digits = |parser: &mut Self| {
            while parser.text.get(parser.at).is_some_and(|c| c.is_ascii_digit() || *c == '.') {
                parser.at += 1;
            }
        };
        digits(self);
        let exponent = |k: usize| self.text.get(k).is_some_and(char::is_ascii_digit);
        if matches!(self.text.get(self.at), Some('e' | 'E')) {
            let signed = matches!(self.text.get(self.at + 1), Some('+' | '-'));
            if exponent(self.at + 1 + usize::from(signed)) {
                self.at += 1 + usize::from(signed);
                digits(self);
            }
        }
        let text: String = self.text[start..self.at].iter().collect();
        let value = text.parse::<f64>().ok().filter(|value| value.is_finite());
        value.map(|value| format!("{value:?}")).ok_or_else(|| self.refuse(start, format!("`{text}` is not a number")))
    }

    fn word(&mut self) -> Parsed {
        let start = self.at;
        while self.text.get(self.at).is_some_and(|c| c.is_ascii_alphanumeric() || *c == '_') {
            self.at += 1;
        }
        let word: String = self.text[start..self.at].iter().collect();
        if self.peek() != Some('(') {
            if word == "pi" {
                return Ok(format!("{:?}", std::f64::consts::PI));
            }
            return (self.name)(&word).map_err(|problem| self.refuse(start, problem));
        }
        let two = OF_TWO.into_iter().find(|name| *name == word);
        let Some(function) = two.or_else(|| FUNCTIONS.into_iter().find(|name| *name == word)) else {
            let known = FUNCTIONS.into_iter().chain(OF_TWO).collect::<Vec<_>>().join(", ");
            return Err(self.refuse(start, format!("`{word}` is not a function; there are {known}")));
        };
        self.at += 1;
        let mut arguments = self.sum()?;
        if two.is_some() {
            if !self.take(',') {
                return Err(self.refuse(self.at, format!("expected `,`: {function} takes two arguments")));
            }
            arguments += ", ";
            arguments += &self.sum()?;
        }
        self.close()?;
        self.call(function);
        Ok(format!("{function}({arguments})"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cpp(text: &str) -> Result<String, String> {
        let mut name = |name: &str| match name {
            "x" => Ok("in[0]".to_owned()),
            other => Err(format!("no {other}")),
        };
        translate(text, &mut name).map(|found| found.cpp).map_err(|error| error.to_string())
    }

    #[test]
    fn operators_bind_as_in_mathematics() {
        assert_eq!(cpp("1 + 2*x").unwrap(), "(1.0 + (2.0 * in[0]))");
        assert_eq!(cpp("-x^2").unwrap(), "(-pow(in[0], 2.0))");
        assert_eq!(cpp("2**x**3").unwrap(), "pow(2.0, pow(in[0], 3.0))");
        assert_eq!(cpp("x - 1 - 2").unwrap(), "((in[0] - 1.0) - 2.0)");
        assert_eq!(cpp("x^-2").unwrap(), "pow(in[0], (-2.0))");
        assert_eq!(cpp("1.5e-3*sin(x)").unwrap(), "(0.0015 * sin(in[0]))");
        assert_eq!(cpp("atan2(x, 2)").unwrap(), "atan2(in[0], 2.0)");
    }

    #[test]
    fn what_is_wrong_is_named_with_its_place() {
        for (text, expected) in [
            ("x +", "`x +`, character 4: expected a number, a name or `(`, found the end"),
            ("x y", "`x y`, character 3: expected an operator or the end, found `y`"),
            ("(x", "`(x`, character 3: expected `)`"),
            ("z", "`z`, character 1: no z"),
            ("system(x)", "`system(x)`, character 1: `system` is not a function; there are sin, cos"),
            ("1.2.3", "`1.2.3`, character 1: `1.2.3` is not a number"),
            ("x; y", "`x; y`, character 2: expected an operator or the end, found `;`"),
            ("hypot(x)", "`hypot(x)`, character 8: expected `,`: hypot takes two arguments"),
        ] {
            assert!(cpp(text).unwrap_err().starts_with(expected), "{text}: {}", cpp(text).unwrap_err());
        }
        assert!(cpp(&"(".repeat(3000)).unwrap_err().contains("at most 100 levels"));
        assert!(cpp(&format!("x{}", "^x".repeat(1000))).unwrap_err().contains("at most 100 powers"));
        assert!(cpp(&"1".repeat(5000)).unwrap_err().contains("at most 4000"));
    }
}
