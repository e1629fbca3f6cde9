(* The coupling of both loops: T1, T2, T3; the inversion: T17; and projection: T8. *)
From Coq Require Import Reals Lra Psatz.
Require Import Basics Functions Statements.
Open Scope R_scope.

Definition small : R := 7378697629483821 / 73786976294838206464. (* the float 1e-4, below which the ratio is a series *)

Definition ratio (h : R) : R :=
  if Rlt_dec (Rabs h) small then 1 - h * h / 6 else sin h / (if Rlt_dec (Rabs h) small then 1 else h).

Lemma small_bounds : 0 < small < 1 / 9999.
Proof. unfold small; split; lra. Qed.

Lemma ratio_far : forall h, small <= Rabs h -> ratio h * h = sin h.
Proof.
  intros h H. unfold ratio. destruct (Rlt_dec (Rabs h) small); [lra |].
  field. intro Z. subst. rewrite Rabs_R0 in H. pose proof small_bounds. lra.
Qed.

Lemma fifth : forall h, 0 <= h -> h < 1 / 9999 -> 0 <= h * h * h * h * h <= 1 / 9999 / 9999 / 9999 / 9999 / 9999.
Proof.
  intros h L H. assert (A : 0 <= h * h <= 1 / 9999 / 9999) by nra.
  assert (B : 0 <= (h * h) * (h * h) <= 1 / 9999 / 9999 / 9999 / 9999) by nra.
  replace (h * h * h * h * h) with (((h * h) * (h * h)) * h) by ring. nra.
Qed.

Lemma ratio_near : forall h, Rabs (ratio h * h - sin h) <= 1 / 10 ^ 20.
Proof.
  assert (P : forall h, 0 <= h -> Rabs (ratio h * h - sin h) <= 1 / 10 ^ 20).
  { intros h N. destruct (Rlt_dec (Rabs h) small) as [L | G].
    - unfold ratio. destruct (Rlt_dec (Rabs h) small); [| lra]. rewrite Rabs_right in L by lra.
      pose proof small_bounds. pose proof (sine_cubic h ltac:(lra)). pose proof (fifth h N ltac:(lra)).
      apply Rabs_le. split; lra.
    - rewrite ratio_far by lra. rewrite Rminus_diag_eq by reflexivity. rewrite Rabs_R0. lra. }
  intro h. destruct (Rle_dec 0 h) as [H | H]; [auto |].
  pose proof (P (- h) ltac:(lra)) as Q. replace (ratio (- h)) with (ratio h) in Q.
  - rewrite sin_neg in Q. replace (ratio h * - h - - sin h) with (- (ratio h * h - sin h)) in Q by ring.
    rewrite Rabs_Ropp in Q. exact Q.
  - unfold ratio. rewrite Rabs_Ropp. destruct (Rlt_dec (Rabs h) small); [field |].
    rewrite sin_neg. field. intro Z. subst. rewrite Rabs_R0 in n. pose proof small_bounds. lra.
Qed.

Lemma ratio_bound : forall h, -1 <= ratio h <= 1.
Proof.
  intro h. destruct (Rlt_dec (Rabs h) small) as [L | G].
  - unfold ratio. destruct (Rlt_dec (Rabs h) small); [| lra]. pose proof small_bounds.
    apply Rabs_def2 in L. assert (h * h <= 1) by nra. pose proof (Rle_0_sqr h). unfold Rsqr in *. lra.
  - pose proof (ratio_far h ltac:(lra)) as E. pose proof (sine_square h) as S. rewrite <- E in S.
    assert (N : h * h > 0). { destruct (Req_dec h 0) as [-> | Z]; [rewrite Rabs_R0 in G; pose proof small_bounds; lra | nra]. }
    assert (ratio h * ratio h <= 1). { apply Rmult_le_reg_r with (h * h); nra. } nra.
Qed.

Lemma sine_gap : forall a w, sin w - sin a = 2 * cos (1 / 2 * (w + a)) * sin (1 / 2 * (w - a)).
Proof.
  intros. replace w with (1 / 2 * (w + a) + 1 / 2 * (w - a)) at 1 by field.
  replace a with (1 / 2 * (w + a) - 1 / 2 * (w - a)) at 3 by field.
  rewrite sin_plus, sin_minus. ring.
Qed.

Lemma cosine_gap : forall a w, cos w - cos a = - 2 * sin (1 / 2 * (w + a)) * sin (1 / 2 * (w - a)).
Proof.
  intros. replace w with (1 / 2 * (w + a) + 1 / 2 * (w - a)) at 1 by field.
  replace a with (1 / 2 * (w + a) - 1 / 2 * (w - a)) at 3 by field.
  rewrite cos_plus, cos_minus. ring.
Qed.

(* fold the emitted `where` of half_sine_ratio *)
Ltac fold_ratio h :=
  change (if Rlt_dec (Rabs h) (7378697629483821 / 73786976294838206464) then 1 - h * h / 6
          else sin h / (if Rlt_dec (Rabs h) (7378697629483821 / 73786976294838206464) then 1 else h)) with (ratio h).

Theorem T1_holds : T1.
Proof.
  unfold T1. intros a1 a2 w1 w2 H1 H2. fold_ratio (1 / 2 * (w1 - a1)). fold_ratio (1 / 2 * (w2 - a2)).
  assert (F : forall w a, 1152921504606847 / 1152921504606846976 <= Rabs (w - a) -> small <= Rabs (1 / 2 * (w - a))).
  { intros w a H. rewrite Rabs_mult, (Rabs_right (1 / 2)) by lra. pose proof small_bounds. lra. }
  pose proof (ratio_far _ (F _ _ H1)) as E1. pose proof (ratio_far _ (F _ _ H2)) as E2.
  pose proof (sine_gap a1 w1) as S1. pose proof (cosine_gap a1 w1) as C1.
  pose proof (sine_gap a2 w2) as S2. pose proof (cosine_gap a2 w2) as C2.
  rewrite <- E1 in S1, C1. rewrite <- E2 in S2, C2.
  generalize dependent (ratio (1 / 2 * (w1 - a1))). generalize dependent (ratio (1 / 2 * (w2 - a2))). intros q _ S2 C2 p _ S1 C1.
  repeat split.
  - nra.
  - replace (cos w1 * sin w2 - cos a1 * sin a2) with (cos w1 * (sin w2 - sin a2) + sin a2 * (cos w1 - cos a1)) by ring.
    rewrite S2, C1. field.
  - replace (cos w1 * cos w2 - cos a1 * cos a2) with (cos w1 * (cos w2 - cos a2) + cos a2 * (cos w1 - cos a1)) by ring.
    rewrite C2, C1. field.
Qed.

Lemma two_parts : forall a b x y c, -1 <= a <= 1 -> -1 <= b <= 1 -> Rabs x <= c -> Rabs y <= c -> 0 <= c ->
  Rabs (2 * (a * x) + 2 * (b * y)) <= 4 * c.
Proof.
  intros a b x y c A B X Y C. apply Rabs_le.
  assert (Rabs (a * x) <= c). { rewrite Rabs_mult. assert (Rabs a <= 1) by (apply Rabs_le; lra). pose proof (Rabs_pos a). pose proof (Rabs_pos x). nra. }
  assert (Rabs (b * y) <= c). { rewrite Rabs_mult. assert (Rabs b <= 1) by (apply Rabs_le; lra). pose proof (Rabs_pos b). pose proof (Rabs_pos y). nra. }
  apply Rabs_within in H. apply Rabs_within in H0. lra.
Qed.

Lemma product_bound : forall x y, -1 <= x <= 1 -> -1 <= y <= 1 -> -1 <= x * y <= 1.
Proof. intros. nra. Qed.

Theorem T1_near_holds : T1_near.
Proof.
  unfold T1_near. intros a1 a2 w1 w2. fold_ratio (1 / 2 * (w1 - a1)). fold_ratio (1 / 2 * (w2 - a2)).
  pose proof (ratio_near (1 / 2 * (w1 - a1))) as E1. pose proof (ratio_near (1 / 2 * (w2 - a2))) as E2.
  set (m1 := 1 / 2 * (w1 + a1)) in *. set (m2 := 1 / 2 * (w2 + a2)) in *.
  pose proof (sine_gap a1 w1) as S1. pose proof (cosine_gap a1 w1) as C1.
  pose proof (sine_gap a2 w2) as S2. pose proof (cosine_gap a2 w2) as C2. fold m1 in S1, C1. fold m2 in S2, C2.
  set (p := ratio (1 / 2 * (w1 - a1))) in *. set (q := ratio (1 / 2 * (w2 - a2))) in *.
  set (x := p * (1 / 2 * (w1 - a1)) - sin (1 / 2 * (w1 - a1))) in *.
  set (y := q * (1 / 2 * (w2 - a2)) - sin (1 / 2 * (w2 - a2))) in *.
  assert (X : sin (1 / 2 * (w1 - a1)) = p * (1 / 2 * (w1 - a1)) - x) by (unfold x; ring).
  assert (Y : sin (1 / 2 * (w2 - a2)) = q * (1 / 2 * (w2 - a2)) - y) by (unfold y; ring).
  rewrite X in S1, C1. rewrite Y in S2, C2. clearbody x y p q.
  assert (Z : Rabs 0 <= 1 / 10 ^ 20) by (rewrite Rabs_R0; lra).
  repeat split.
  - replace (- sin w1 - - sin a1 - _) with (2 * (cos m1 * x) + 2 * (0 * 0)) by (replace (sin w1) with (sin a1 + (sin w1 - sin a1)) by ring; rewrite S1; field).
    eapply Rle_trans; [apply (two_parts _ _ _ _ (1 / 10 ^ 20)); auto using cosine_bounds; lra | lra].
  - match goal with |- Rabs ?t <= _ => replace t with (2 * ((sin a2 * sin m1) * x) + 2 * ((- (cos w1 * cos m2)) * y)) end.
    + eapply Rle_trans; [apply (two_parts _ _ _ _ (1 / 10 ^ 20)); auto; try lra | lra].
      * apply product_bound; apply sine_bounds.
      * pose proof (product_bound _ _ (cosine_bounds w1) (cosine_bounds m2)). lra.
    + replace (cos w1 * sin w2 - cos a1 * sin a2) with (cos w1 * (sin w2 - sin a2) + sin a2 * (cos w1 - cos a1)) by ring.
      rewrite S2, C1. field.
  - match goal with |- Rabs ?t <= _ => replace t with (2 * ((cos a2 * sin m1) * x) + 2 * ((cos w1 * sin m2) * y)) end.
    + eapply Rle_trans; [apply (two_parts _ _ _ _ (1 / 10 ^ 20)); auto; try lra | lra].
      * apply product_bound; [apply cosine_bounds | apply sine_bounds].
      * apply product_bound; [apply cosine_bounds | apply sine_bounds].
    + replace (cos w1 * cos w2 - cos a1 * cos a2) with (cos w1 * (cos w2 - cos a2) + cos a2 * (cos w1 - cos a1)) by ring.
      rewrite C2, C1. field.
Qed.

Theorem T2_holds : T2.
Proof.
  unfold T2. intros a1 a2 w1 w2.
  replace (_ + _ + _) with (2 * (1 - cos (w1 - a1)) + 2 * (cos w1 * cos a1) * (1 - cos (w2 - a2))).
  - pose proof (versine (w1 - a1)) as V1. pose proof (versine (w2 - a2)) as V2.
    pose proof (product_bound _ _ (cosine_bounds w1) (cosine_bounds a1)) as P.
    pose proof (cosine_bounds (w2 - a2)). nra.
  - rewrite !cos_minus. pose proof (circle w1). pose proof (circle a1). pose proof (circle w2). pose proof (circle a2).
    set (s1 := sin w1) in *. set (c1 := cos w1) in *. set (s2 := sin a1) in *. set (c2 := cos a1) in *.
    set (s3 := sin w2) in *. set (c3 := cos w2) in *. set (s4 := sin a2) in *. set (c4 := cos a2) in *. clearbody s1 c1 s2 c2 s3 c3 s4 c4.
    replace (2 * (1 - (c1 * c2 + s1 * s2)) + 2 * (c1 * c2) * (1 - (c3 * c4 + s3 * s4)))
      with (1 + 1 - 2 * s1 * s2 - 2 * (c1 * c2) * (c3 * c4 + s3 * s4)) by ring.
    rewrite <- H at 1. rewrite <- H0 at 1.
    replace (c1 * c1) with (c1 * c1 * (s3 * s3 + c3 * c3)) by (rewrite H1; ring).
    replace (c2 * c2) with (c2 * c2 * (s4 * s4 + c4 * c4)) by (rewrite H2; ring). ring.
Qed.

Lemma square_bound : forall p x y, -1 <= p <= 1 -> x * x + y * y = 1 -> p * p * (x * x + y * y) <= 1.
Proof. intros p x y P E. rewrite E. nra. Qed.

Theorem T3_holds : T3.
Proof.
  unfold T3. intros a1 a2 w1 w2. fold_ratio (1 / 2 * (w1 - a1)). fold_ratio (1 / 2 * (w2 - a2)).
  pose proof (ratio_bound (1 / 2 * (w1 - a1))) as P. pose proof (ratio_bound (1 / 2 * (w2 - a2))) as Q.
  set (p := ratio (1 / 2 * (w1 - a1))) in *. set (q := ratio (1 / 2 * (w2 - a2))) in *. clearbody p q.
  pose proof (circle (1 / 2 * (w1 + a1))) as C1. pose proof (circle (1 / 2 * (w2 + a2))) as C2. pose proof (circle a2) as C3.
  split.
  - match goal with |- ?t <= _ => replace t with (p * p * (cos (1 / 2 * (w1 + a1)) * cos (1 / 2 * (w1 + a1))
      + sin (1 / 2 * (w1 + a1)) * sin (1 / 2 * (w1 + a1)) * (sin a2 * sin a2 + cos a2 * cos a2))) by ring end.
    rewrite C3, Rmult_1_r. apply square_bound; [exact P | lra].
  - match goal with |- ?t <= _ => replace t with ((cos w1 * q) * (cos w1 * q) * (cos (1 / 2 * (w2 + a2)) * cos (1 / 2 * (w2 + a2))
      + sin (1 / 2 * (w2 + a2)) * sin (1 / 2 * (w2 + a2)))) by ring end.
    apply square_bound; [apply product_bound; [apply cosine_bounds | exact Q] | lra].
Qed.

Lemma mixed : forall x y c d, - d <= c <= d -> 2 * (x * y * c) <= d * (x * x + y * y).
Proof.
  intros x y c d H. pose proof (Rle_0_sqr (x - y)) as A. pose proof (Rle_0_sqr (x + y)) as B. unfold Rsqr in A, B.
  assert (P : 0 <= (d - c) * ((x + y) * (x + y))) by (apply Rmult_le_pos; lra).
  assert (Q : 0 <= (d + c) * ((x - y) * (x - y))) by (apply Rmult_le_pos; lra). lra.
Qed.

Theorem B_norm_holds : B_norm.
Proof.
  unfold B_norm. intros a1 a2 w1 w2 x1 x2. pose proof (T3_holds a1 a2 w1 w2) as [C1 C2].
  fold_ratio (1 / 2 * (w1 - a1)). fold_ratio (1 / 2 * (w2 - a2)).
  change (if Rlt_dec (Rabs (1 / 2 * (w1 - a1))) (7378697629483821 / 73786976294838206464) then 1 - 1 / 2 * (w1 - a1) * (1 / 2 * (w1 - a1)) / 6
    else sin (1 / 2 * (w1 - a1)) / (if Rlt_dec (Rabs (1 / 2 * (w1 - a1))) (7378697629483821 / 73786976294838206464) then 1 else 1 / 2 * (w1 - a1)))
    with (ratio (1 / 2 * (w1 - a1))) in C1.
  change (if Rlt_dec (Rabs (1 / 2 * (w2 - a2))) (7378697629483821 / 73786976294838206464) then 1 - 1 / 2 * (w2 - a2) * (1 / 2 * (w2 - a2)) / 6
    else sin (1 / 2 * (w2 - a2)) / (if Rlt_dec (Rabs (1 / 2 * (w2 - a2))) (7378697629483821 / 73786976294838206464) then 1 else 1 / 2 * (w2 - a2)))
    with (ratio (1 / 2 * (w2 - a2))) in C2.
  pose proof (ratio_bound (1 / 2 * (w1 - a1))) as P. pose proof (ratio_bound (1 / 2 * (w2 - a2))) as Q.
  assert (S : sin a2 * cos (1 / 2 * (w2 + a2)) - cos a2 * sin (1 / 2 * (w2 + a2)) = - sin (1 / 2 * (w2 - a2))).
  { rewrite <- sin_minus, <- sin_neg. f_equal. field. }
  set (p := ratio (1 / 2 * (w1 - a1))) in *. set (q := ratio (1 / 2 * (w2 - a2))) in *. clearbody p q.
  set (m := sin (1 / 2 * (w1 + a1))) in *. set (h := sin (1 / 2 * (w2 - a2))) in *.
  set (d := p * (cos w1 * q) * (m * h)).
  assert (D : - (Rabs m * Rabs h) <= d <= Rabs m * Rabs h).
  { apply Rabs_within. unfold d. rewrite !Rabs_mult. pose proof (Rabs_pos m). pose proof (Rabs_pos h).
    assert (0 <= Rabs m * Rabs h) by (apply Rmult_le_pos; assumption).
    assert (A : Rabs p * (Rabs (cos w1) * Rabs q) <= 1).
    { rewrite <- !Rabs_mult. apply Rabs_le. apply product_bound; [exact P | apply product_bound; [apply cosine_bounds | exact Q]]. }
    pose proof (Rabs_pos p). pose proof (Rabs_pos (cos w1)). pose proof (Rabs_pos q). nra. }
  pose proof (mixed x1 x2 d _ D) as M.
  match goal with |- ?t <= _ => set (whole := t) end.
  match type of C1 with ?t <= _ => set (f := t) in * end. match type of C2 with ?t <= _ => set (g := t) in * end.
  assert (E : whole = x1 * x1 * f + x2 * x2 * g + 2 * (x1 * x2 * d)).
  { unfold whole, f, g, d. replace (m * h) with (- (m * - h)) by ring. rewrite <- S. ring. }
  rewrite E. assert (x1 * x1 * f <= x1 * x1 * 1) by (apply Rmult_le_compat_l; [apply Rle_0_sqr | exact C1]).
  assert (x2 * x2 * g <= x2 * x2 * 1) by (apply Rmult_le_compat_l; [apply Rle_0_sqr | exact C2]). lra.
Qed.

Theorem T3_ratio_holds : T3_ratio.
Proof. unfold T3_ratio. intro x. fold_ratio (1 / 2 * x). apply Rabs_le. apply ratio_bound. Qed.

(* the point (x, y) by its distance and its angle *)
Lemma polar : forall y x, sqrt (x * x + y * y) * cos (atan2 y x) = x /\ sqrt (x * x + y * y) * sin (atan2 y x) = y.
Proof.
  intros y x.
  assert (P : forall t, 0 < sqrt (1 + Rsqr t)) by (intro t; apply sqrt_lt_R0; pose proof (Rle_0_sqr t); lra).
  assert (D : x <> 0 -> sqrt (x * x + y * y) = Rabs x * sqrt (1 + Rsqr (y / x))).
  { intro N. rewrite <- (sqrt_Rsqr_abs x), <- sqrt_mult; [| apply Rle_0_sqr | pose proof (Rle_0_sqr (y / x)); lra].
    f_equal. unfold Rsqr. field. exact N. }
  unfold atan2. destruct (Rlt_dec 0 x); [| destruct (Rlt_dec x 0)].
  - rewrite D by lra. rewrite Rabs_right, cos_atan, sin_atan by lra. pose proof (P (y / x)). split; field; repeat split; lra.
  - rewrite D by lra. rewrite Rabs_left by lra. pose proof (P (y / x)).
    destruct (Rle_dec 0 y).
    + rewrite neg_cos, neg_sin, cos_atan, sin_atan. split; field; repeat split; lra.
    + rewrite cos_minus, sin_minus, cos_PI, sin_PI, cos_atan, sin_atan. split; field; repeat split; lra.
  - assert (Z : x = 0) by lra. subst x. replace (0 * 0 + y * y) with (Rsqr y) by (unfold Rsqr; ring). rewrite sqrt_Rsqr_abs.
    destruct (Rlt_dec 0 y); [| destruct (Rlt_dec y 0)].
    + rewrite Rabs_right, cos_PI2, sin_PI2 by lra. split; ring.
    + rewrite Rabs_left, cos_neg, sin_neg, cos_PI2, sin_PI2 by lra. split; ring.
    + assert (Y : y = 0) by lra. subst y. rewrite Rabs_R0. split; ring.
Qed.

Theorem T17_holds : T17.
Proof.
  unfold T17. intros f1 f2 f3. pose proof (polar f2 f3) as [PC PS]. set (b := sqrt (f2 * f2 + f3 * f3)).
  replace (f3 * f3 + f2 * f2) with (f2 * f2 + f3 * f3) in PC, PS by ring. fold b in PC, PS.
  pose proof (polar (- f1) b) as [TC TS]. set (u := sqrt (f1 * f1 + b * b)).
  replace (b * b + - f1 * - f1) with (f1 * f1 + b * b) in TC, TS by ring. fold u in TC, TS.
  assert (U0 : 0 <= u) by apply sqrt_pos. assert (B0 : 0 <= b) by apply sqrt_pos.
  assert (UU : u * u = f1 * f1 + b * b) by (apply sqrt_sqrt; nra).
  clearbody u b. destruct (Rgt_dec u 0).
  - destruct (Rgt_dec b 0).
    + rewrite <- !Rmult_assoc, TC, PC, PS. repeat split; lra.
    + assert (Z : b = 0) by lra. rewrite Z in *. rewrite sin_0, cos_0, <- !Rmult_assoc, TC. repeat split; lra.
  - assert (Z : u = 0) by lra. rewrite Z in *. assert (b = 0) by nra. assert (f1 = 0) by nra. repeat split; nra.
Qed.

Theorem T8_holds : T8.
Proof.
  unfold T8. intros bound x1 x2 x3 y1 y2 y3 B Y.
  set (n := sqrt _). assert (N : 0 <= n) by apply sqrt_pos.
  assert (E : n * n = x1 * x1 + x2 * x2 + x3 * x3) by (unfold n; apply sqrt_sqrt; nra).
  clearbody n. destruct (Rgt_dec n bound) as [L | G]; [| apply Req_le; ring].
  set (f := bound / n). assert (F : f * n = bound) by (unfold f; field; lra).
  assert (F1 : 0 < f < 1). { split. - unfold f; apply Rdiv_lt_0_compat; lra. - apply Rmult_lt_reg_r with n; lra. }
  clearbody f.
  assert (C : x1 * y1 + x2 * y2 + x3 * y3 <= f * (n * n)).
  { replace (f * (n * n)) with (n * bound) by (rewrite <- F; ring).
    assert (S : (x1 * y1 + x2 * y2 + x3 * y3) * (x1 * y1 + x2 * y2 + x3 * y3) <= (n * bound) * (n * bound)).
    { apply Rle_trans with ((x1 * x1 + x2 * x2 + x3 * x3) * (y1 * y1 + y2 * y2 + y3 * y3)).
      - pose proof (Rle_0_sqr (x1 * y2 - x2 * y1)). pose proof (Rle_0_sqr (x1 * y3 - x3 * y1)).
        pose proof (Rle_0_sqr (x2 * y3 - x3 * y2)). unfold Rsqr in *. lra.
      - rewrite <- E. replace ((n * bound) * (n * bound)) with ((n * n) * (bound * bound)) by ring.
        apply Rmult_le_compat_l; nra. }
    assert (0 <= n * bound) by nra. nra. }
  nra.
Qed.
