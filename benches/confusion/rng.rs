//! Pseudo-random numbers (splitmix64): the same seed gives the same parts, effects and noise everywhere.

/// State of the generator.
#[derive(Debug, Clone)]
pub struct Rng(u64);

impl Rng {
    /// From a seed and a stream number; streams of one seed are independent.
    pub fn new(seed: u64, stream: u64) -> Self {
        let mut rng = Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ stream.wrapping_mul(0xD1B5_4A32_D192_ED03));
        rng.next();
        rng
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Uniform in [low, high).
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Index below `n`.
    pub fn index(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }

    /// One of the items.
    pub fn pick<T: Copy>(&mut self, items: &[T]) -> T {
        items[self.index(items.len())]
    }

    /// −1 or +1.
    pub fn sign(&mut self) -> f64 {
        self.pick(&[-1.0, 1.0])
    }

    /// Standard normal (Box and Muller).
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * self.uniform(1e-16, 1.0).ln()).sqrt();
        radius * self.uniform(0.0, std::f64::consts::TAU).cos()
    }

    /// Random order (Fisher and Yates).
    pub fn shuffle<T>(&mut self, items: &mut [T]) {
        for i in (1..items.len()).rev() {
            items.swap(i, self.index(i + 1));
        }
    }
}

/// A pack of values that is dealt out in random order and reshuffled when empty, so that every value comes equally often.
#[derive(Debug, Clone)]
pub struct Deck {
    values: Vec<f64>,
    left: Vec<f64>,
}

impl Deck {
    /// Of these values.
    pub fn new(values: &[f64]) -> Self {
        Self { values: values.to_vec(), left: Vec::new() }
    }
    /// The next one.
    pub fn deal(&mut self, rng: &mut Rng) -> f64 {
        if self.left.is_empty() {
            self.left = self.values.clone();
            rng.shuffle(&mut self.left);
        }
        self.left.pop().expect("a deck has values")
    }
}
