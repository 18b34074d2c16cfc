//! Addresses of the served page. In: path and query of a request. Out: names and values as they were meant, and back.

/// Parts of a path and pairs of a query.
pub type Address = (Vec<String>, Vec<(String, String)>);

/// A name as a part of an address.
pub fn encoded(name: &str) -> String {
    let plain = |byte: u8| byte.is_ascii_alphanumeric() || b"-._~".contains(&byte);
    let one = |byte| if plain(byte) { char::from(byte).to_string() } else { format!("%{byte:02X}") };
    name.bytes().map(one).collect()
}

/// What an encoded part means; `None` where it is spelled wrong or is not UTF-8.
pub fn decoded(part: &str) -> Option<String> {
    let mut bytes = Vec::new();
    let mut rest = part.bytes();
    while let Some(byte) = rest.next() {
        bytes.push(match byte {
            b'+' => b' ',
            b'%' => {
                let digit = |byte: Option<u8>| char::from(byte?).to_digit(16);
                (digit(rest.next())? * 16 + digit(rest.next())?) as u8
            }
            other => other,
        });
    }
    String::from_utf8(bytes).ok()
}

/// The parts of a path and the pairs of its query; `None` where one is spelled wrong. A slash inside a part is no slash of the path.
pub fn read(target: &str) -> Option<Address> {
    let (path, query) = target.split_once('?').unwrap_or((target, ""));
    // In a path a plus is a plus.
    let parts =
        path.strip_prefix('/')?.split('/').map(|part| decoded(&part.replace('+', "%2B"))).collect::<Option<_>>()?;
    let pair = |pair: &str| {
        let (key, value) = pair.split_once('=').unwrap_or((pair, ""));
        Some((decoded(key)?, decoded(value)?))
    };
    let pairs = query.split('&').filter(|pair| !pair.is_empty()).map(pair).collect::<Option<_>>()?;
    Some((parts, pairs))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_come_back_as_they_were() {
        for name in ["part.nc", "Teil 1+2 (neu).nc", "größe%.nc", "a/b", ".."] {
            assert_eq!(decoded(&encoded(name)).as_deref(), Some(name));
            assert!(!encoded(name).contains('/'));
        }
        let (parts, pairs) = read("/t/program/a+b%2Fc?force_xy=110+lbf&x").unwrap();
        assert_eq!(parts, ["t", "program", "a+b/c"]);
        assert_eq!(pairs, [("force_xy".into(), "110 lbf".into()), ("x".into(), String::new())]);
        for wrong in ["http://other/", "/%", "/%G1", "/%FF", "/a?b=%4"] {
            assert_eq!(read(wrong), None, "{wrong}");
        }
    }
}
