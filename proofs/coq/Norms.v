(* Lengths, the least of three numbers, and sums of squares with weights; nothing here is emitted. *)
From Coq Require Import Reals Lra Psatz List.
Require Import Basics.
Import ListNotations.
Open Scope R_scope.

(* Cauchy and Schwarz, for any number of entries *)
Definition pairing (l : list (R * R)) : R := fold_right (fun p rest => fst p * snd p + rest) 0 l.
Definition firsts (l : list (R * R)) : R := fold_right (fun p rest => fst p * fst p + rest) 0 l.
Definition seconds (l : list (R * R)) : R := fold_right (fun p rest => snd p * snd p + rest) 0 l.

Lemma cauchy_squares : forall l, 0 <= firsts l /\ 0 <= seconds l /\ pairing l * pairing l <= firsts l * seconds l.
Proof.
  induction l as [| [a b] l [F [S P]]]; simpl; [lra |].
  fold (firsts l) (seconds l) (pairing l). set (f := firsts l) in *. set (s := seconds l) in *. set (d := pairing l) in *. clearbody f s d.
  pose proof (Rle_0_sqr a) as A. pose proof (Rle_0_sqr b) as B. unfold Rsqr in A, B. repeat split; try lra.
  assert (X : 2 * (a * b * d) <= a * a * s + b * b * f).
  { assert (Y : (2 * (a * b * d)) * (2 * (a * b * d)) <= (a * a * s + b * b * f) * (a * a * s + b * b * f)).
    { assert (a * a * (b * b) * (d * d) <= a * a * (b * b) * (f * s)) by (apply Rmult_le_compat_l; [apply Rmult_le_pos; lra | lra]).
      pose proof (Rle_0_sqr (a * a * s - b * b * f)) as Q. unfold Rsqr in Q. lra. }
    assert (0 <= a * a * s + b * b * f) by (apply Rplus_le_le_0_compat; apply Rmult_le_pos; lra). nra. }
  lra.
Qed.

Lemma cauchy_norms : forall l, pairing l <= sqrt (firsts l) * sqrt (seconds l).
Proof.
  intro l. destruct (cauchy_squares l) as [F [S P]]. rewrite <- sqrt_mult by assumption. destruct (Rle_dec (pairing l) 0).
  - eapply Rle_trans; [eassumption | apply sqrt_pos].
  - rewrite <- (sqrt_square (pairing l)) by lra. apply sqrt_le_1_alt. exact P.
Qed.

Lemma cauchy3 : forall a1 a2 a3 b1 b2 b3 x y, x = sqrt (a1 * a1 + a2 * a2 + a3 * a3) -> y = sqrt (b1 * b1 + b2 * b2 + b3 * b3) ->
  a1 * b1 + a2 * b2 + a3 * b3 <= x * y.
Proof.
  intros a1 a2 a3 b1 b2 b3 x y -> ->. eapply Rle_trans; [| eapply Rle_trans; [apply (cauchy_norms [(a1, b1); (a2, b2); (a3, b3)]) |]].
  - right. unfold pairing. simpl. ring.
  - right. unfold firsts, seconds. simpl. f_equal; f_equal; ring.
Qed.

Lemma cauchy6 : forall a1 a2 a3 a4 a5 a6 b1 b2 b3 b4 b5 b6 x y,
  x = sqrt (a1 * a1 + a2 * a2 + a3 * a3 + (a4 * a4 + a5 * a5 + a6 * a6)) -> y = sqrt (b1 * b1 + b2 * b2 + b3 * b3 + (b4 * b4 + b5 * b5 + b6 * b6)) ->
  a1 * b1 + a2 * b2 + a3 * b3 + (a4 * b4 + a5 * b5 + a6 * b6) <= x * y.
Proof.
  intros a1 a2 a3 a4 a5 a6 b1 b2 b3 b4 b5 b6 x y -> ->.
  eapply Rle_trans; [| eapply Rle_trans; [apply (cauchy_norms [(a1, b1); (a2, b2); (a3, b3); (a4, b4); (a5, b5); (a6, b6)]) |]].
  - right. unfold pairing. simpl. ring.
  - right. unfold firsts, seconds. simpl. f_equal; f_equal; ring.
Qed.

(* what forgetting adds: tr(W~^T W^) <= |W~| |W| - |W~|^2, for two nets of two neurons *)
Lemma forgetting : forall w1 w2 w3 w4 w5 w6 w7 w8 w9 w10 w11 w12 u1 u2 u3 u4 u5 u6 u7 u8 u9 u10 u11 u12 x y,
  x = sqrt ((w1 - u1) * (w1 - u1) + (w2 - u2) * (w2 - u2) + (w3 - u3) * (w3 - u3) + ((w4 - u4) * (w4 - u4) + (w5 - u5) * (w5 - u5) + (w6 - u6) * (w6 - u6))
    + ((w7 - u7) * (w7 - u7) + (w8 - u8) * (w8 - u8) + (w9 - u9) * (w9 - u9) + ((w10 - u10) * (w10 - u10) + (w11 - u11) * (w11 - u11) + (w12 - u12) * (w12 - u12)))) ->
  y = sqrt (w1 * w1 + w2 * w2 + w3 * w3 + (w4 * w4 + w5 * w5 + w6 * w6) + (w7 * w7 + w8 * w8 + w9 * w9 + (w10 * w10 + w11 * w11 + w12 * w12))) ->
  (w1 - u1) * u1 + (w2 - u2) * u2 + (w3 - u3) * u3 + ((w4 - u4) * u4 + (w5 - u5) * u5 + (w6 - u6) * u6)
  + ((w7 - u7) * u7 + (w8 - u8) * u8 + (w9 - u9) * u9 + ((w10 - u10) * u10 + (w11 - u11) * u11 + (w12 - u12) * u12)) <= x * y - x * x.
Proof.
  intros. set (l := [(w1 - u1, w1); (w2 - u2, w2); (w3 - u3, w3); (w4 - u4, w4); (w5 - u5, w5); (w6 - u6, w6);
    (w7 - u7, w7); (w8 - u8, w8); (w9 - u9, w9); (w10 - u10, w10); (w11 - u11, w11); (w12 - u12, w12)]).
  pose proof (cauchy_norms l) as C. destruct (cauchy_squares l) as [F _].
  assert (X : x = sqrt (firsts l)) by (rewrite H; f_equal; unfold firsts, l; simpl; ring).
  assert (Y : y = sqrt (seconds l)) by (rewrite H0; f_equal; unfold seconds, l; simpl; ring).
  rewrite <- X, <- Y in C. assert (XX : x * x = firsts l) by (rewrite X; apply sqrt_sqrt; exact F). rewrite XX.
  match goal with |- ?t <= _ => replace t with (pairing l - firsts l) by (unfold pairing, firsts, l; simpl; ring) end. lra.
Qed.

Lemma length_square : forall a b c x, x = sqrt (a * a + b * b + c * c) -> x * x = a * a + b * b + c * c.
Proof.
  intros a b c x ->. apply sqrt_sqrt. pose proof (Rle_0_sqr a). pose proof (Rle_0_sqr b). pose proof (Rle_0_sqr c). unfold Rsqr in *. lra.
Qed.

Lemma weighted_length : forall l k1 k2 k3 r1 r2 r3 x, l <= k1 -> l <= k2 -> l <= k3 -> x = sqrt (r1 * r1 + r2 * r2 + r3 * r3) ->
  - (r1 * (k1 * r1) + r2 * (k2 * r2) + r3 * (k3 * r3)) <= - (l * x * x).
Proof.
  intros l k1 k2 k3 r1 r2 r3 x A B C X. pose proof (length_square _ _ _ _ X) as E. rewrite Rmult_assoc, E.
  assert (Q : forall k r, l <= k -> l * (r * r) <= r * (k * r)).
  { intros k r H. replace (r * (k * r)) with (k * (r * r)) by ring. apply Rmult_le_compat_r; [apply Rle_0_sqr | exact H]. }
  pose proof (Q k1 r1 A). pose proof (Q k2 r2 B). pose proof (Q k3 r3 C). lra.
Qed.

Definition least_of (a b c : R) : R := if Rlt_dec (if Rlt_dec a b then a else b) c then (if Rlt_dec a b then a else b) else c.
Definition most_of (a b c : R) : R := if Rgt_dec (if Rgt_dec a b then a else b) c then (if Rgt_dec a b then a else b) else c.

Lemma least_of_three : forall a b c x, x = least_of a b c -> x <= a /\ x <= b /\ x <= c.
Proof. intros a b c x ->. unfold least_of. destruct (Rlt_dec a b). - destruct (Rlt_dec a c); lra. - destruct (Rlt_dec b c); lra. Qed.

Lemma most_of_three : forall a b c x, x = most_of a b c -> a <= x /\ b <= x /\ c <= x.
Proof. intros a b c x ->. unfold most_of. destruct (Rgt_dec a b). - destruct (Rgt_dec a c); lra. - destruct (Rgt_dec b c); lra. Qed.

(* what a series leaves of three entries, weighted by a vector *)
Lemma left_by_series : forall u r1 r2 r3 x1 x2 x3 c, 0 <= u -> Rabs x1 <= c -> Rabs x2 <= c -> Rabs x3 <= c ->
  Rabs (u * (r1 * x1 + r2 * x2 + r3 * x3)) <= c * (u * (Rabs r1 + Rabs r2 + Rabs r3)).
Proof.
  intros u r1 r2 r3 x1 x2 x3 c U A B C. rewrite Rabs_mult, (Rabs_right u) by lra.
  assert (T : Rabs (r1 * x1 + r2 * x2 + r3 * x3) <= c * (Rabs r1 + Rabs r2 + Rabs r3)).
  { assert (Q : forall r x, Rabs x <= c -> Rabs (r * x) <= c * Rabs r).
    { intros r x H. rewrite Rabs_mult, Rmult_comm. apply Rmult_le_compat_r; [apply Rabs_pos | exact H]. }
    pose proof (Q r1 x1 A). pose proof (Q r2 x2 B). pose proof (Q r3 x3 C).
    pose proof (Rabs_triang (r1 * x1 + r2 * x2) (r3 * x3)). pose proof (Rabs_triang (r1 * x1) (r2 * x2)). lra. }
  replace (c * (u * (Rabs r1 + Rabs r2 + Rabs r3))) with (u * (c * (Rabs r1 + Rabs r2 + Rabs r3))) by ring.
  apply Rmult_le_compat_l; assumption.
Qed.

(* a sampled filter's share of what it held: 1 - e^(-x) (1 + x) > 0 *)
Lemma passed : forall x, 0 < x -> 1 - exp (- x) * (1 + x) <> 0.
Proof.
  intros x X. pose proof (exp_ineq1 x ltac:(lra)) as I. pose proof (exp_pos (- x)) as P.
  assert (E : exp (- x) * exp x = 1) by (rewrite <- exp_plus, Rplus_opp_l; apply exp_0). nra.
Qed.
