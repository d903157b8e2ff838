//! The caches of a multiprocessor: L1 for data, and one for instructions.

/// Sectors of 32 bytes in 192 KB: the 256 KB of an H100 without what shared memory and the driver take.
const SECTORS: usize = 6144;

/// Lines of 128 bytes, eight instructions, in 128 KB.
const LINES: usize = 1024;

/// Cycles of a miss of the next line of instructions, which is prefetched.
const NEXT_LINE: u64 = 40;
/// Cycles of a miss of any other line.
const OTHER_LINE: u64 = 260;

/// Direct-mapped caches.
pub struct Cache {
    sectors: Vec<u64>,
    lines: Vec<u64>,
}

impl Cache {
    pub fn new() -> Self {
        Self { sectors: vec![0; SECTORS], lines: vec![0; LINES] }
    }

    /// Is the sector there? It is from now on.
    pub fn has(&mut self, sector: u64) -> bool {
        // Neighbours have places side by side, local memories and lists far apart.
        let place = (sector ^ (sector >> 32).wrapping_mul(0x9e37_79b9)) % SECTORS as u64;
        std::mem::replace(&mut self.sectors[place as usize], sector) == sector
    }

    /// Cycles until a line of instructions is there, after another one.
    pub fn fetch(&mut self, line: u64, last: u64) -> u64 {
        match std::mem::replace(&mut self.lines[line as usize % LINES], line) {
            old if old == line => 0,
            _ if line == last + 1 => NEXT_LINE,
            _ => OTHER_LINE,
        }
    }

    /// Forgets the instructions, as another kernel begins.
    pub fn forget_code(&mut self) {
        self.lines.fill(0);
    }
}
