(* J, its derivatives and C: T4, T5, T6 and what the determinant and the solution of a linear system are. *)
From Coq Require Import Reals Lra Psatz.
Require Import Basics Statements.
Open Scope R_scope.

(* sines and cosines as numbers on a circle *)
Ltac on_circles theta phi :=
  let T := fresh "T" in let F := fresh "F" in
  pose proof (circle theta) as T; pose proof (circle phi) as F;
  set (st := sin theta) in *; set (ct := cos theta) in *; set (sf := sin phi) in *; set (cf := cos phi) in *;
  clearbody st ct sf cf.

Theorem J_symmetric_holds : J_symmetric.
Proof. unfold J_symmetric. intros. repeat split; ring. Qed.

(* |T x|^2 = |x|^2 - 2 sin theta x1 x3: the eigenvalues of T^T T are 1 and 1 +- sin theta *)
Lemma turned : forall st ct sf cf x1 x2 x3, st * st + ct * ct = 1 -> sf * sf + cf * cf = 1 ->
  (- st * x1 + x3) * (- st * x1 + x3) + (ct * sf * x1 + cf * x2) * (ct * sf * x1 + cf * x2)
  + (ct * cf * x1 - sf * x2) * (ct * cf * x1 - sf * x2) = x1 * x1 + x2 * x2 + x3 * x3 - 2 * st * x1 * x3.
Proof.
  intros. replace (_ + _ + _) with (st * st * (x1 * x1) + x3 * x3 - 2 * st * x1 * x3
    + ct * ct * (x1 * x1) * (sf * sf + cf * cf) + (sf * sf + cf * cf) * (x2 * x2)) by ring.
  rewrite H0. replace (ct * ct) with (1 - st * st) by lra. ring.
Qed.

Lemma between : forall st x1 x3, -1 <= st <= 1 -> - Rabs st * (x1 * x1 + x3 * x3) <= 2 * st * x1 * x3 <= Rabs st * (x1 * x1 + x3 * x3).
Proof.
  intros st x1 x3 H. pose proof (Rabs_pos st). pose proof (Rle_0_sqr (x1 - x3)). pose proof (Rle_0_sqr (x1 + x3)). unfold Rsqr in *.
  unfold Rabs in *. destruct (Rcase_abs st); nra.
Qed.

Lemma weighted : forall s1 s2 s3 most a b c, s1 <= most -> s2 <= most -> s3 <= most ->
  s1 * (a * a) + s2 * (b * b) + s3 * (c * c) <= most * (a * a + b * b + c * c).
Proof. intros. nra. Qed.

Lemma weighted_least : forall s1 s2 s3 least a b c, least <= s1 -> least <= s2 -> least <= s3 ->
  least * (a * a + b * b + c * c) <= s1 * (a * a) + s2 * (b * b) + s3 * (c * c).
Proof. intros. nra. Qed.

Theorem T4_holds : T4.
Proof.
  unfold T4. intros. pose proof (sine_bounds theta) as S. on_circles theta phi.
  match goal with |- ?t <= _ => replace t with (s1 * ((- st * r1 + r3) * (- st * r1 + r3))
    + s2 * ((ct * sf * r1 + cf * r2) * (ct * sf * r1 + cf * r2)) + s3 * ((ct * cf * r1 - sf * r2) * (ct * cf * r1 - sf * r2))) by ring end.
  eapply Rle_trans; [apply (weighted s1 s2 s3 most); assumption |]. rewrite turned by assumption.
  pose proof (between st r1 r3 S). pose proof (Rabs_pos st). pose proof (Rle_0_sqr r2) as Q. unfold Rsqr in Q.
  match goal with |- _ <= ?a * ?b * ?c => replace (a * b * c) with (a * (b * c)) by ring end. apply Rmult_le_compat_l; nra.
Qed.

Theorem T4_least_holds : T4_least.
Proof.
  unfold T4_least. intros. pose proof (sine_bounds theta) as S. on_circles theta phi.
  match goal with |- _ <= ?t => replace t with (s1 * ((- st * r1 + r3) * (- st * r1 + r3))
    + s2 * ((ct * sf * r1 + cf * r2) * (ct * sf * r1 + cf * r2)) + s3 * ((ct * cf * r1 - sf * r2) * (ct * cf * r1 - sf * r2))) by ring end.
  eapply Rle_trans; [| apply (weighted_least s1 s2 s3 least); assumption]. rewrite turned by assumption.
  pose proof (between st r1 r3 S). pose proof (Rabs_pos st). pose proof (Rle_0_sqr r2) as Q. unfold Rsqr in Q.
  match goal with |- ?a * ?b * ?c <= _ => replace (a * b * c) with (a * (b * c)) by ring end. apply Rmult_le_compat_l; nra.
Qed.

(* a weighted inner product is at most half of both squares, however they are scaled *)
Lemma young : forall s a b l, 0 < s -> 0 < l -> 2 * (s * (a * b)) <= l * (s * (a * a)) + / l * (s * (b * b)).
Proof.
  intros s a b l S L. assert (0 <= s * / l * ((l * a - b) * (l * a - b))).
  { apply Rmult_le_pos; [apply Rmult_le_pos; [lra | left; apply Rinv_0_lt_compat; lra] | apply Rle_0_sqr]. }
  replace (s * / l * ((l * a - b) * (l * a - b))) with (l * (s * (a * a)) + / l * (s * (b * b)) - 2 * (s * (a * b))) in H by (field; lra).
  lra.
Qed.

Theorem T5_holds : T5.
Proof.
  unfold T5. intros. pose proof (sine_bounds theta) as S. on_circles theta phi.
  assert (P : forall x1 x2 x3, s1 * ((- st * x1 + x3) * (- st * x1 + x3)) + s2 * ((ct * sf * x1 + cf * x2) * (ct * sf * x1 + cf * x2))
    + s3 * ((ct * cf * x1 - sf * x2) * (ct * cf * x1 - sf * x2)) <= 2 * most * (x1 * x1 + x2 * x2 + x3 * x3)).
  { intros. eapply Rle_trans; [apply (weighted s1 s2 s3 most); assumption |]. rewrite turned by assumption.
    pose proof (between st x1 x3 S). assert (Rabs st <= 1) by (apply Rabs_le; lra). pose proof (Rabs_pos st).
    pose proof (Rle_0_sqr x2) as Q. unfold Rsqr in Q. replace (2 * most) with (most * 2) by ring. rewrite (Rmult_assoc most 2). apply Rmult_le_compat_l; nra. }
  assert (L : 0 < slope) by lra.
  pose proof (P r1 r2 r3) as A. pose proof (P (l1 * r1) (l2 * r2) (l3 * r3)) as B.
  set (u1 := - st * r1 + r3) in *. set (u2 := ct * sf * r1 + cf * r2) in *. set (u3 := ct * cf * r1 - sf * r2) in *.
  set (v1 := - st * (l1 * r1) + l3 * r3) in *. set (v2 := ct * sf * (l1 * r1) + cf * (l2 * r2)) in *.
  set (v3 := ct * cf * (l1 * r1) - sf * (l2 * r2)) in *.
  pose proof (young s1 u1 v1 slope ltac:(assumption) L) as Y1. pose proof (young s2 u2 v2 slope ltac:(assumption) L) as Y2.
  pose proof (young s3 u3 v3 slope ltac:(assumption) L) as Y3.
  match goal with |- _ <= ?k - ?t => replace t with (s1 * (u1 * v1) + s2 * (u2 * v2) + s3 * (u3 * v3))
    by (unfold u1, u2, u3, v1, v2, v3; ring) end.
  assert (I : 0 < / slope) by (apply Rinv_0_lt_compat; lra). assert (IL : / slope * slope = 1) by (field; lra).
  assert (D : / slope * (s1 * (v1 * v1) + s2 * (v2 * v2) + s3 * (v3 * v3)) <= slope * (2 * most * (r1 * r1 + r2 * r2 + r3 * r3))).
  { eapply Rle_trans; [apply Rmult_le_compat_l; [lra | exact B] |].
    assert (M : 0 < most) by lra.
    assert (l1 * r1 * (l1 * r1) + l2 * r2 * (l2 * r2) + l3 * r3 * (l3 * r3) <= slope * slope * (r1 * r1 + r2 * r2 + r3 * r3)).
    { assert (forall l r, 0 < l -> l <= slope -> l * r * (l * r) <= slope * slope * (r * r)).
      { intros. replace (l * r * (l * r)) with (l * l * (r * r)) by ring. apply Rmult_le_compat_r; [apply Rle_0_sqr | nra]. }
      pose proof (H14 l1 r1 ltac:(assumption) ltac:(assumption)). pose proof (H14 l2 r2 ltac:(assumption) ltac:(assumption)).
      pose proof (H14 l3 r3 ltac:(assumption) ltac:(assumption)). lra. }
    replace (slope * (2 * most * (r1 * r1 + r2 * r2 + r3 * r3))) with (/ slope * (2 * most * (slope * slope * (r1 * r1 + r2 * r2 + r3 * r3)))).
    - apply Rmult_le_compat_l; [lra |]. apply Rmult_le_compat_l; lra.
    - replace (/ slope * (2 * most * (slope * slope * (r1 * r1 + r2 * r2 + r3 * r3))))
        with ((/ slope * slope) * (slope * (2 * most * (r1 * r1 + r2 * r2 + r3 * r3)))) by ring. rewrite IL. ring. }
  assert (E : slope * (s1 * (u1 * u1) + s2 * (u2 * u2) + s3 * (u3 * u3)) <= slope * (2 * most * (r1 * r1 + r2 * r2 + r3 * r3)))
    by (apply Rmult_le_compat_l; lra).
  assert (K : k4 * (r1 * r1 + r2 * r2 + r3 * r3) <= r1 * (k1 * r1) + r2 * (k2 * r2) + r3 * (k3 * r3)) by nra.
  assert (Z : s1 * (u1 * v1) + s2 * (u2 * v2) + s3 * (u3 * v3) <= slope * (2 * most * (r1 * r1 + r2 * r2 + r3 * r3))) by lra.
  lra.
Qed.

Theorem T6_holds : T6.
Proof. unfold T6. intros. field. Qed.

Theorem T6_transpose_holds : T6_transpose.
Proof. unfold T6_transpose. intros. repeat split; field. Qed.

Theorem C_norm_holds : C_norm.
Proof.
  unfold C_norm. intros. on_circles theta phi.
  assert (F2 : cf * cf = 1 - sf * sf) by lra.
  match goal with |- ?t * ?t <= _ => replace t with (s * ct / 2 * (w3 * (y2 * r1 - y1 * r2) - w2 * (y1 * r3 + y3 * r1) + w1 * (y2 * r3 - y3 * r2)))
    by (field_simplify_eq; ring [F2]) end.
  set (a := y2 * r1 - y1 * r2). set (b := - (y1 * r3 + y3 * r1)). set (c := y2 * r3 - y3 * r2).
  replace (w3 * a - w2 * (y1 * r3 + y3 * r1) + w1 * c) with (w3 * a + w2 * b + w1 * c) by (unfold b; ring).
  assert (N : (w3 * a + w2 * b + w1 * c) * (w3 * a + w2 * b + w1 * c) <= (w1 * w1 + w2 * w2 + w3 * w3) * (a * a + b * b + c * c)).
  { pose proof (Rle_0_sqr (w3 * b - w2 * a)). pose proof (Rle_0_sqr (w3 * c - w1 * a)). pose proof (Rle_0_sqr (w2 * c - w1 * b)).
    unfold Rsqr in *. lra. }
  assert (M : a * a + b * b + c * c <= 2 * ((r1 * r1 + r2 * r2 + r3 * r3) * (y1 * y1 + y2 * y2 + y3 * y3))).
  { unfold a, b, c. pose proof (Rle_0_sqr (y1 * r1 - y3 * r3)). pose proof (Rle_0_sqr (y1 * r1 + y2 * r2)). pose proof (Rle_0_sqr (y1 * r2 + y2 * r1)).
    pose proof (Rle_0_sqr (y2 * r2 + y3 * r3)). pose proof (Rle_0_sqr (y2 * r3 + y3 * r2)). pose proof (Rle_0_sqr (y1 * r3 - y3 * r1)).
    pose proof (Rle_0_sqr (y1 * r1)). pose proof (Rle_0_sqr (y2 * r2)). pose proof (Rle_0_sqr (y3 * r3)). unfold Rsqr in *. nra. }
  replace (s * ct / 2 * (w3 * a + w2 * b + w1 * c) * (s * ct / 2 * (w3 * a + w2 * b + w1 * c)))
    with (s * s * (ct * ct) / 4 * ((w3 * a + w2 * b + w1 * c) * (w3 * a + w2 * b + w1 * c))) by field.
  pose proof (Rle_0_sqr s) as SS. pose proof (Rle_0_sqr st) as ST. pose proof (Rle_0_sqr ct) as CT. unfold Rsqr in *.
  assert (0 <= s * s * (ct * ct) <= s * s) by (split; nra).
  set (W := w1 * w1 + w2 * w2 + w3 * w3) in *. assert (0 <= W) by (unfold W; nra).
  set (G := (r1 * r1 + r2 * r2 + r3 * r3) * (y1 * y1 + y2 * y2 + y3 * y3)) in *.
  assert (X : W * (a * a + b * b + c * c) <= W * (2 * G)) by (apply Rmult_le_compat_l; lra).
  assert (0 <= W * (2 * G)) by (apply Rmult_le_pos; [lra | unfold G; nra]).
  replace (1 / 2 * (s * s) * W * (r1 * r1 + r2 * r2 + r3 * r3) * (y1 * y1 + y2 * y2 + y3 * y3)) with (s * s / 4 * (W * (2 * G))) by (unfold G; field).
  apply Rle_trans with (s * s * (ct * ct) / 4 * (W * (2 * G))).
  - apply Rmult_le_compat_l; lra.
  - apply Rmult_le_compat_r; lra.
Qed.

Theorem C_rates_holds : C_rates.
Proof.
  unfold C_rates. intros. on_circles theta phi. assert (F2 : cf * cf = 1 - sf * sf) by lra. assert (T2 : ct * ct = 1 - st * st) by lra.
  repeat split; field_simplify_eq; ring [F2 T2].
Qed.

Theorem solved_holds : solved.
Proof. unfold solved. intros. repeat split; field; intro Z; apply H; rewrite <- Z; ring. Qed.

Theorem J_determinant_holds : J_determinant.
Proof.
  unfold J_determinant. intros. on_circles theta phi.
  match goal with |- ?t = _ => replace t with (s1 * s2 * s3 * (ct * ct) * ((sf * sf + cf * cf) * (sf * sf + cf * cf))) by ring end.
  rewrite F. replace (ct * ct) with (1 - st * st) by lra. ring.
Qed.
