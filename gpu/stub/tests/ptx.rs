//! PTX on the CPU: does each instruction do what NVIDIA's manual says, and do threads that part meet again?

use sdf_gpu_stub::ptx::{Card, function};

/// Sums the numbers up to each thread's own by a loop, squares the sum in a call where the thread is odd, and keeps it in a local array.
const SUMS: &str = "
.func  (.param .b64 func_retval0) square
(
	.param .b64 square_param_0
)
;
.visible .entry sums(
	.param .u64 .ptr .align 1 sums_param_0,
	.param .u32 sums_param_1
)
{
	.local .align 8 .b8 	__local_depot0[16];
	.reg .b64 	%SP;
	ld.param.b64 	%rd1, [sums_param_0];
	ld.param.b32 	%r1, [sums_param_1];
	mov.b64 	%SPL, __local_depot0;
	mov.u32 	%r2, %ctaid.x;
	mov.u32 	%r3, %ntid.x;
	mov.u32 	%r4, %tid.x;
	mad.lo.s32 	%r5, %r2, %r3, %r4;
	setp.ge.u32 	%p1, %r5, %r1;
	@%p1 bra 	$L__BB0_4;
// %bb.1:
	mov.b64 	%rd2, 0;
	cvt.u64.u32 	%rd3, %r5;
$L__BB0_2:                              // =>This Inner Loop Header: Depth=1
	add.s64 	%rd2, %rd2, %rd3;
	add.s64 	%rd3, %rd3, -1;
	setp.gt.s64 	%p2, %rd3, 0;
	@%p2 bra 	$L__BB0_2;
// %bb.3:
	st.local.b64 	[%SPL+8], %rd2;
	and.b32 	%r6, %r5, 1;
	setp.eq.b32 	%p3, %r6, 0;
	@%p3 bra 	$L__BB0_5;
	ld.local.b64 	%rd4, [%SPL+8];
	{ // callseq 0, 0
	.param .b64 	param0;
	.param .b64 	retval0;
	st.param.b64 	[param0], %rd4;
	call.uni (retval0), square, (param0);
	ld.param.b64 	%rd5, [retval0];
	} // callseq 0
	st.local.b64 	[%SPL+8], %rd5;
$L__BB0_5:
	mul.wide.u32 	%rd6, %r5, 8;
	add.s64 	%rd7, %rd1, %rd6;
	ld.local.b64 	%rd8, [%SPL+8];
	st.global.b64 	[%rd7], %rd8;
$L__BB0_4:
	ret;
}
.func  (.param .b64 func_retval0) square(
	.param .b64 square_param_0
)
{
	ld.param.b64 	%rd1, [square_param_0];
	mul.lo.s64 	%rd2, %rd1, %rd1;
	st.param.b64 	[func_retval0], %rd2;
	ret;
}
";

#[test]
#[should_panic(expected = "a store of 2 bytes of %rd2, which has more")]
fn a_store_of_part_of_a_register_is_refused() {
    Card::new(&changed("st.local.b64 \t[%SPL+8], %rd2", "st.local.b16 \t[%SPL+8], %rd2"));
}

#[test]
#[should_panic(expected = "of another memory")]
fn an_address_of_local_memory_is_no_generic_one() {
    run(&changed("st.local.b64 \t[%SPL+8], %rd2", "st.b64 \t[%SPL+8], %rd2"), 129);
}

#[test]
#[should_panic(expected = "is not aligned for 1 × 8 bytes")]
fn an_address_that_is_not_aligned_is_refused() {
    run(&changed("st.local.b64 \t[%SPL+8], %rd2", "st.local.b64 \t[%SPL+4], %rd2"), 129);
}

/// The program with other words.
fn changed(from: &str, to: &str) -> String {
    assert!(SUMS.contains(from), "{from}");
    SUMS.replace(from, to)
}

/// The program's numbers for so many of 130 threads, and the time that they took.
fn run(program: &str, count: u32) -> ([u64; 130], f64) {
    let mut card = Card::new(program);
    let mut sums = [u64::MAX; 130];
    let address = sums.as_mut_ptr();
    let arguments = [(&raw const address).cast(), (&raw const count).cast()];
    // SAFETY: there is room for each number.
    unsafe { card.launch("sums", &arguments, 3, 64) };
    (sums, card.time)
}

#[test]
fn threads_loop_part_and_call_each_for_itself_and_time_passes() {
    let (sums, time) = run(SUMS, 129);
    for (number, sum) in (0..129_u64).zip(sums) {
        let expected = number * (number + 1) / 2;
        assert_eq!(sum, if number % 2 == 1 { expected * expected } else { expected }, "{number}");
    }
    assert_eq!(sums[129], u64::MAX);
    let (_, shorter) = run(SUMS, 100);
    assert!(shorter > 0.0 && shorter < time, "fewer numbers take less time: {time}, {shorter}");
}

/// Sums taken apart into halves of 32 bits, the lower of these into halves of 16, and put together again.
#[test]
fn a_number_is_split_into_halves_and_made_of_them() {
    let halves = "{ .reg .b32 tmp; mov.b64 {tmp, %r9}, %rd8; }
	mov.b64 	{%r8, %r10}, %rd8;
	{ .reg .b16 tmp; mov.b32 {%rs1, tmp}, %r8; }
	{ .reg .b16 tmp; mov.b32 {tmp, %rs2}, %r8; }
	mov.b32 	%r11, {%rs1, %rs2};
	mov.b64 	%rd8, {%r11, %r9};
	st.global.b64 	[%rd7], %rd8;";
    let (sums, _) = run(&changed("st.global.b64 	[%rd7], %rd8;", halves), 129);
    assert!(sums[127] > 1 << 16);
    assert_eq!(sums, run(SUMS, 129).0);
}

/// In eights, the sum of the fourth thread, and a bit for each whose number is even. Threads of even numbers come by a detour, which lies
/// behind the shuffle.
const IN_EIGHTS: &str = "@%p3 bra 	$L__BB0_7;
$L__BB0_6:
	and.b32 	%r20, %r4, 24;
	shl.b32 	%r21, 255, %r20;
	cvt.u32.u64 	%r22, %rd8;
	shfl.sync.idx.b32 	%r23, %r22, 3, 6175, %r21;
	vote.sync.ballot.b32 	%r24, %p3, %r21;
	mov.b64 	%rd8, {%r23, %r24};
	st.global.b64 	[%rd7], %rd8;
	ret;
$L__BB0_7:
	add.s64 	%rd8, %rd8, 1;
	bra.uni 	$L__BB0_6;";

#[test]
fn threads_that_shuffle_wait_for_each_other() {
    let store = "st.global.b64 	[%rd7], %rd8;";
    let (sums, _) = run(&changed(store, IN_EIGHTS), 128);
    for (number, sum) in (0..128_u64).zip(sums) {
        let (eight, fourth) = (number / 8 * 8, number / 8 * 8 + 3);
        let expected = (fourth * (fourth + 1) / 2).pow(2);
        let bits = 0b0101_0101 << (eight % 32);
        assert_eq!([sum & 0xffff_ffff, sum >> 32], [expected, bits], "{number}");
    }
}

#[test]
#[should_panic(expected = "threads wait at a shuffle for others that have ended")]
fn a_shuffle_without_some_of_its_threads_is_refused() {
    run(&changed("st.global.b64 	[%rd7], %rd8;", IN_EIGHTS), 127);
}

#[test]
fn operations_are_those_of_the_manual() {
    let run =
        |operation: &str, [a, b, c]: [u64; 3]| function(operation).unwrap_or_else(|| panic!("{operation}"))(a, b, c);
    let (nan, one) = (f32::NAN.to_bits().into(), 1.0_f32.to_bits().into());
    let minus_three = u64::from((-3_i32) as u32);
    let cases: [(&str, [u64; 3], u64); 22] = [
        ("add.rn.f32", [one, one, 0], 2.0_f32.to_bits().into()),
        ("min.f32", [nan, one, 0], one),
        ("setp.lt.f32", [nan, one, 0], 0),
        ("setp.ltu.f32", [nan, one, 0], 1),
        ("setp.neu.f32", [one, one, 0], 0),
        ("setp.ne.f32", [nan, one, 0], 0),
        ("setp.lt.s32", [minus_three, 2, 0], 1),
        ("setp.lt.u32", [minus_three, 2, 0], 0),
        ("mul.hi.u64", [1 << 63, 6, 0], 3),
        ("mul.wide.s32", [minus_three, 2, 0], (-6_i64) as u64),
        ("mad.lo.s32", [minus_three, 2, 7], 1),
        ("shr.s32", [minus_three, 40, 0], 0xffff_ffff),
        ("shr.u32", [minus_three, 40, 0], 0),
        ("shl.b32", [1, 33, 0], 0),
        ("selp.b64", [5, 6, 0], 6),
        ("not.pred", [1, 0, 0], 0),
        ("not.b32", [0, 0, 0], 0xffff_ffff),
        ("bfe.u32", [0xabcd, 4, 8], 0xbc),
        ("prmt.b32", [0x4433_2211, 0x8877_6655, 0x5410], 0x6655_2211),
        ("cvt.rzi.u32.f32", [(-2.5_f32).to_bits().into(), 0, 0], 0),
        ("cvt.s32.s16", [0xfffd, 0, 0], minus_three),
        ("cvt.u16.u32", [0x1_2345, 0, 0], 0x2345),
    ];
    for (operation, operands, expected) in cases {
        assert_eq!(run(operation, operands), expected, "{operation} of {operands:x?}");
    }
}
