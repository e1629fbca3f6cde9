(* Learning, the command filter, and the form of Theorem A: T7, T13, T14, T16. *)
From Coq Require Import Reals Lra Psatz.
Require Import Basics Statements.
Open Scope R_scope.

(* Cauchy and Schwarz for six entries, by the squares of the minors *)
Lemma cauchy : forall a1 a2 a3 a4 a5 a6 b1 b2 b3 b4 b5 b6,
  (a1 * b1 + a2 * b2 + a3 * b3 + a4 * b4 + a5 * b5 + a6 * b6) * (a1 * b1 + a2 * b2 + a3 * b3 + a4 * b4 + a5 * b5 + a6 * b6)
  <= (a1 * a1 + a2 * a2 + a3 * a3 + a4 * a4 + a5 * a5 + a6 * a6) * (b1 * b1 + b2 * b2 + b3 * b3 + b4 * b4 + b5 * b5 + b6 * b6).
Proof.
  intros.
  match goal with |- ?l <= ?r => assert (E : r - l =
    Rsqr (a1 * b2 - a2 * b1) + Rsqr (a1 * b3 - a3 * b1) + Rsqr (a1 * b4 - a4 * b1) + Rsqr (a1 * b5 - a5 * b1) + Rsqr (a1 * b6 - a6 * b1)
    + Rsqr (a2 * b3 - a3 * b2) + Rsqr (a2 * b4 - a4 * b2) + Rsqr (a2 * b5 - a5 * b2) + Rsqr (a2 * b6 - a6 * b2)
    + Rsqr (a3 * b4 - a4 * b3) + Rsqr (a3 * b5 - a5 * b3) + Rsqr (a3 * b6 - a6 * b3)
    + Rsqr (a4 * b5 - a5 * b4) + Rsqr (a4 * b6 - a6 * b4) + Rsqr (a5 * b6 - a6 * b5)) by (unfold Rsqr; ring) end.
  assert (S : forall x, 0 <= Rsqr x) by (intro; apply Rle_0_sqr).
  apply Rminus_le. match goal with |- ?l - ?r <= 0 => replace (l - r) with (- (r - l)) by ring end. rewrite E.
  repeat match goal with |- context [Rsqr ?t] => let q := fresh in pose proof (S t) as q; generalize dependent (Rsqr t); intros end. lra.
Qed.

Lemma product_of_roots : forall a b c, 0 <= a -> 0 <= b -> c * c <= a * b -> c <= sqrt a * sqrt b.
Proof.
  intros a b c A B H. rewrite <- sqrt_mult by assumption. destruct (Rle_dec c 0).
  - eapply Rle_trans; [exact r | apply sqrt_pos].
  - rewrite <- (sqrt_square c) by lra. apply sqrt_le_1_alt. exact H.
Qed.

Theorem T7_holds : T7.
Proof.
  unfold T7. intros. match goal with |- _ <= sqrt ?a * sqrt ?b - _ => set (A := a); set (B := b) end.
  assert (P : 0 <= A) by (unfold A; nra). assert (Q : 0 <= B) by (unfold B; nra).
  pose proof (cauchy e11 e12 e13 e21 e22 e23 w11 w12 w13 w21 w22 w23) as C.
  assert (D : e11 * w11 + e12 * w12 + e13 * w13 + e21 * w21 + e22 * w22 + e23 * w23 <= sqrt A * sqrt B).
  { apply product_of_roots; [exact P | exact Q |]. eapply Rle_trans; [exact C |]. right. unfold A, B. ring. }
  clearbody A B. lra.
Qed.

Lemma convex : forall s b x y z, 0 <= s <= 1 -> 0 < b -> 0 <= x -> x <= b * b -> 0 <= y -> y <= s * b * (s * b) -> z * z <= x * y ->
  (1 - s) * (1 - s) * x + 2 * ((1 - s) * z) + y <= b * b.
Proof.
  intros s b x y z S B X0 X Y0 Y Z.
  assert (ZZ : z <= s * (b * b)).
  { assert (z * z <= s * (b * b) * (s * (b * b))).
    { eapply Rle_trans; [exact Z |]. replace (s * (b * b) * (s * (b * b))) with (b * b * (s * b * (s * b))) by ring.
      apply Rmult_le_compat; assumption. }
    assert (0 <= s * (b * b)) by nra. nra. }
  assert ((1 - s) * (1 - s) * x <= (1 - s) * (1 - s) * (b * b)) by (apply Rmult_le_compat_l; [nra | exact X]).
  assert ((1 - s) * z <= (1 - s) * (s * (b * b))) by (apply Rmult_le_compat_l; lra). nra.
Qed.

Theorem T16_holds : T16.
Proof.
  unfold T16. intros bound f kappa m1 m2 period r1 r2 r3 size w11 w12 w13 w21 w22 w23 K F T N B NB SB W R M1 M2 M3 M4.
  set (s := f * kappa * size * period) in *. set (g := f * period).
  assert (G : 0 < g) by (unfold g; nra). assert (S0 : 0 <= s) by (unfold s; apply Rmult_le_pos; [apply Rmult_le_pos; nra | lra]).
  match goal with |- ?t <= _ => replace t with
    ((1 - s) * (1 - s) * (w11 * w11 + w12 * w12 + w13 * w13 + w21 * w21 + w22 * w22 + w23 * w23)
     + 2 * ((1 - s) * (w11 * (g * m1 * r1) + w12 * (g * m1 * r2) + w13 * (g * m1 * r3) + w21 * (g * m2 * r1) + w22 * (g * m2 * r2) + w23 * (g * m2 * r3)))
     + (g * m1 * r1 * (g * m1 * r1) + g * m1 * r2 * (g * m1 * r2) + g * m1 * r3 * (g * m1 * r3)
        + g * m2 * r1 * (g * m2 * r1) + g * m2 * r2 * (g * m2 * r2) + g * m2 * r3 * (g * m2 * r3)))
    by (unfold s, g; ring) end.
  apply convex; try assumption; try nra.
  - match goal with |- ?t <= _ => replace t with (g * g * ((m1 * m1 + m2 * m2) * (r1 * r1 + r2 * r2 + r3 * r3))) by ring end.
    replace (s * bound * (s * bound)) with (g * g * (kappa * bound * (kappa * bound) * (size * size))) by (unfold s, g; ring).
    apply Rmult_le_compat_l; [nra |].
    assert (m1 * m1 + m2 * m2 <= 2) by nra. assert (0 <= m1 * m1 + m2 * m2) by nra. assert (0 <= r1 * r1 + r2 * r2 + r3 * r3) by nra.
    eapply Rle_trans with (2 * (size * size)); [apply Rmult_le_compat; lra | apply Rmult_le_compat_r; [nra | lra]].
  - pose proof (cauchy w11 w12 w13 w21 w22 w23 (g * m1 * r1) (g * m1 * r2) (g * m1 * r3) (g * m2 * r1) (g * m2 * r2) (g * m2 * r3)). lra.
Qed.

Theorem T14_holds : T14.
Proof. unfold T14. intros. split; field; lra. Qed.

Theorem T13_holds : T13.
Proof.
  unfold T13. intros k1 k2 l2 u x y z A B C D.
  assert (P : 0 <= k1 * x * x - u * x * y + k2 * l2 * l2 * (y * y)).
  { apply Rmult_le_reg_l with k1; [exact A |]. rewrite Rmult_0_r.
    replace (k1 * (k1 * x * x - u * x * y + k2 * l2 * l2 * (y * y))) with (Rsqr (k1 * x - u * y / 2) + (k1 * k2 * l2 * l2 - u * u / 4) * Rsqr y) by (unfold Rsqr; field).
    pose proof (Rle_0_sqr (k1 * x - u * y / 2)). pose proof (Rle_0_sqr y). assert (0 <= (k1 * k2 * l2 * l2 - u * u / 4) * Rsqr y) by (apply Rmult_le_pos; lra). lra. }
  pose proof (Rle_0_sqr (z - l2 * y)) as Q. unfold Rsqr in Q. nra.
Qed.
