//! Files of little-endian records. In: numbers and lists. Out: bytes with a SHA-256 at their end; and back, `None` where
//! they were changed or end too early.

use sha2::{Digest, Sha256};

/// Bytes of the hash at the end.
const HASH: usize = 32;

/// Appends the number of records of a list.
pub fn count(out: &mut Vec<u8>, n: usize) {
    out.extend_from_slice(&(n as u64).to_le_bytes());
}

/// Appends numbers.
pub fn numbers(out: &mut Vec<u8>, values: &[f64]) {
    for value in values {
        out.extend_from_slice(&value.to_le_bytes());
    }
}

/// Appends the hash of all before it.
pub fn seal(out: &mut Vec<u8>) {
    let sum: [u8; HASH] = Sha256::digest(&*out).into();
    out.extend_from_slice(&sum);
}

/// What follows `mark` in sealed bytes, if they are whole and begin with it.
pub fn unsealed<'a>(bytes: &'a [u8], mark: &[u8]) -> Option<Reader<'a>> {
    let (body, sum) = bytes.split_at_checked(bytes.len().checked_sub(HASH)?)?;
    let rest = body.strip_prefix(mark)?;
    let whole: [u8; HASH] = Sha256::digest(body).into();
    (whole == sum).then_some(Reader { rest })
}

/// Bytes still to be read.
pub struct Reader<'a> {
    rest: &'a [u8],
}

impl<'a> Reader<'a> {
    /// The next bytes.
    pub fn take(&mut self, n: usize) -> Option<&'a [u8]> {
        let (head, rest) = self.rest.split_at_checked(n)?;
        self.rest = rest;
        Some(head)
    }
    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        self.take(N)?.try_into().ok()
    }
    /// The next number.
    pub fn f64(&mut self) -> Option<f64> {
        self.array().map(f64::from_le_bytes)
    }
    /// The next numbers.
    pub fn f64s<const N: usize>(&mut self) -> Option<[f64; N]> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = self.f64()?;
        }
        Some(values)
    }
    /// The next number.
    pub fn f32(&mut self) -> Option<f32> {
        self.array().map(f32::from_le_bytes)
    }
    /// The next count or index.
    pub fn u64(&mut self) -> Option<usize> {
        usize::try_from(self.array().map(u64::from_le_bytes)?).ok()
    }
    /// The next number.
    pub fn u32(&mut self) -> Option<u32> {
        self.array().map(u32::from_le_bytes)
    }
    /// The next number.
    pub fn u16(&mut self) -> Option<u16> {
        self.array().map(u16::from_le_bytes)
    }
    /// The next byte.
    pub fn u8(&mut self) -> Option<u8> {
        self.array().map(|[byte]| byte)
    }
    /// A list: its count, then its records of at least one byte each.
    pub fn list<T>(&mut self, mut record: impl FnMut(&mut Self) -> Option<T>) -> Option<Vec<T>> {
        let n = self.u64()?;
        if n > self.rest.len() {
            return None;
        }
        (0..n).map(|_| record(self)).collect()
    }
}
