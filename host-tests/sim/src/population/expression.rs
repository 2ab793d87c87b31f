//! Sums, differences, products and quotients of numbers and drawn variables: `1000 * modulus_kpa * (1 + modulus_off)`.

/// An expression, read.
#[derive(Clone, Debug, PartialEq)]
pub enum Expression {
    /// A number.
    Number(f64),
    /// A drawn variable.
    Variable(String),
    /// Two, put together.
    Two(Box<Expression>, Operator, Box<Expression>),
}

/// How two are put together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operator {
    /// a + b
    Add,
    /// a - b
    Subtract,
    /// a * b
    Multiply,
    /// a / b
    Divide,
}

impl Operator {
    fn of(letter: u8) -> Option<Self> {
        Some(match letter {
            b'+' => Self::Add,
            b'-' => Self::Subtract,
            b'*' => Self::Multiply,
            b'/' => Self::Divide,
            _ => return None,
        })
    }

    fn apply(self, a: f64, b: f64) -> f64 {
        match self {
            Self::Add => a + b,
            Self::Subtract => a - b,
            Self::Multiply => a * b,
            Self::Divide => a / b,
        }
    }
}

impl Expression {
    /// Reads one.
    pub fn read(text: &str) -> Result<Self, String> {
        let mut rest = text;
        let read = sum(&mut rest)?;
        if rest.trim().is_empty() { Ok(read) } else { Err(format!("`{}` is not understood", rest.trim())) }
    }

    /// The variables in it.
    pub fn variables(&self) -> Vec<&str> {
        match self {
            Self::Number(_) => Vec::new(),
            Self::Variable(name) => vec![name],
            Self::Two(a, _, b) => [a.variables(), b.variables()].concat(),
        }
    }

    /// Its value, where every variable has one.
    pub fn value(&self, variable: &dyn Fn(&str) -> Option<f64>) -> Option<f64> {
        match self {
            Self::Number(number) => Some(*number),
            Self::Variable(name) => variable(name),
            Self::Two(a, operator, b) => Some(operator.apply(a.value(variable)?, b.value(variable)?)),
        }
    }

    /// Within what it lies, where every variable lies within something. Two that go together are taken as if they did
    /// not.
    pub fn range(&self, variable: &dyn Fn(&str) -> Option<[f64; 2]>) -> Option<[f64; 2]> {
        match self {
            Self::Number(number) => Some([*number; 2]),
            Self::Variable(name) => variable(name),
            Self::Two(a, operator, b) => {
                let (a, b) = (a.range(variable)?, b.range(variable)?);
                if *operator == Operator::Divide && b[0] <= 0.0 && b[1] >= 0.0 {
                    return Some([f64::NEG_INFINITY, f64::INFINITY]);
                }
                let all = [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(i, j)| operator.apply(a[i], b[j]));
                Some([all.into_iter().fold(f64::INFINITY, f64::min), all.into_iter().fold(f64::NEG_INFINITY, f64::max)])
            }
        }
    }
}

fn sum(rest: &mut &str) -> Result<Expression, String> {
    chain(rest, b"+-", product)
}

fn product(rest: &mut &str) -> Result<Expression, String> {
    chain(rest, b"*/", term)
}

/// Terms with operators of the same rank between them, from the left.
fn chain(
    rest: &mut &str,
    operators: &[u8],
    part: fn(&mut &str) -> Result<Expression, String>,
) -> Result<Expression, String> {
    let mut all = part(rest)?;
    loop {
        *rest = rest.trim_start();
        let Some(letter) = rest.bytes().next().filter(|letter| operators.contains(letter)) else { return Ok(all) };
        let Some(operator) = Operator::of(letter) else { return Ok(all) };
        *rest = &rest[1..];
        all = Expression::Two(Box::new(all), operator, Box::new(part(rest)?));
    }
}

fn term(rest: &mut &str) -> Result<Expression, String> {
    *rest = rest.trim_start();
    if let Some(inner) = rest.strip_prefix('(') {
        *rest = inner;
        let inside = sum(rest)?;
        *rest = rest.trim_start().strip_prefix(')').ok_or("a `)` is missing")?;
        return Ok(inside);
    }
    let end = rest.find(|c: char| !(c.is_ascii_alphanumeric() || c == '_' || c == '.')).unwrap_or(rest.len());
    let (word, after) = rest.split_at(end);
    *rest = after;
    match word.chars().next() {
        Some(first) if first.is_ascii_digit() => {
            word.parse().map(Expression::Number).map_err(|_| format!("`{word}` is no number"))
        }
        Some(first) if first.is_ascii_alphabetic() => Ok(Expression::Variable(word.into())),
        _ => Err(format!("a number or a variable is missing before `{}`", after.trim())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(text: &str) -> Result<Option<f64>, String> {
        let variable = |name: &str| [("a", 3.0), ("b_mm", 0.5)].into_iter().find(|(n, _)| *n == name).map(|(_, v)| v);
        Expression::read(text).map(|expression| expression.value(&variable))
    }

    #[test]
    fn products_come_before_sums_and_all_goes_from_the_left() {
        assert_eq!(value("1 + 2 * a - 4 / 2 / 2"), Ok(Some(6.0)));
        assert_eq!(value(" 10 * (1 + b_mm)*a "), Ok(Some(45.0)));
        assert_eq!(value("a - b_mm - 1"), Ok(Some(1.5)));
        assert_eq!(value("a * c"), Ok(None));
        for wrong in ["", "1 +", "(1", "1)", "1 a", "* 2", "1.2.3", "-1"] {
            assert!(value(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn the_range_holds_every_value() {
        let range = |text: &str| Expression::read(text).ok()?.range(&|_| Some([-1.0, 2.0]));
        assert_eq!(range("3 * a + 1"), Some([-2.0, 7.0]));
        assert_eq!(range("a * a"), Some([-2.0, 4.0]));
        assert_eq!(range("1 - a"), Some([-1.0, 2.0]));
        assert_eq!(range("1 / a"), Some([f64::NEG_INFINITY, f64::INFINITY]));
        assert_eq!(range("1 / (a + 2)"), Some([0.25, 1.0]));
    }
}
