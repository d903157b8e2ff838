/// Text output, byte by byte, without panics.
pub struct Page<W>(pub W);

impl<W: FnMut(u8)> Page<W> {
    pub fn text(&mut self, text: &str) {
        text.bytes().for_each(&mut self.0);
    }

    /// A name, a space and an integer.
    pub fn integer(&mut self, name: &str, number: u32) {
        self.text(name);
        self.text(" ");
        self.without_leading_zeros(&decimal(number));
    }

    /// A line: the name, then each number in decimal for people (six decimals, below 4000) and as bits.
    pub fn numbers(&mut self, name: &str, numbers: &[f32]) {
        self.text(name);
        for number in numbers {
            self.text(if number.is_sign_negative() { " -" } else { " " });
            let [whole @ .., a, b, c, d, e, f] = decimal((number.abs() * 1e6 + 0.5) as u32);
            self.without_leading_zeros(&whole);
            self.text(".");
            [a, b, c, d, e, f].into_iter().for_each(&mut self.0);
            self.text(" ");
            self.bits(number.to_bits());
        }
        self.text("\n");
    }

    /// Eight hexadecimal digits.
    pub fn bits(&mut self, bits: u32) {
        for nibble in (0..8).rev() {
            (self.0)(b"0123456789abcdef"[(bits >> (4 * nibble) & 15) as usize]);
        }
    }

    fn without_leading_zeros(&mut self, digits: &[u8]) {
        let Some((last, leading)) = digits.split_last() else { return };
        leading.iter().skip_while(|digit| **digit == b'0').copied().for_each(&mut self.0);
        (self.0)(*last);
    }
}

fn decimal(mut number: u32) -> [u8; 10] {
    let mut digits = [0; 10];
    for digit in digits.iter_mut().rev() {
        *digit = b'0' + (number % 10) as u8;
        number /= 10;
    }
    digits
}
