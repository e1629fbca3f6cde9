(* How fast the coupling columns turn: B_rate. *)
From Coq Require Import Reals Lra Psatz.
Require Import Basics Functions Statements Geometry.
Open Scope R_scope.

(* the rate of an expression, piece by piece; that of `ratio` by the tactic given *)
Ltac rate_of other :=
  match goal with
  | |- derivable_pt_lim (fun _ => ?c) _ _ => apply (derivable_pt_lim_const c)
  | |- derivable_pt_lim (fun x => @?f x + @?g x) _ _ => apply (derivable_pt_lim_plus f g); rate_of other
  | |- derivable_pt_lim (fun x => @?f x - @?g x) _ _ => apply (derivable_pt_lim_minus f g); rate_of other
  | |- derivable_pt_lim (fun x => @?f x * @?g x) _ _ => apply (derivable_pt_lim_mult f g); rate_of other
  | |- derivable_pt_lim (fun x => - @?f x) _ _ => apply (derivable_pt_lim_opp f); rate_of other
  | |- derivable_pt_lim (fun x => x) _ _ => apply derivable_pt_lim_id
  | |- derivable_pt_lim (fun x => sin (@?f x)) _ _ => apply (derivable_pt_lim_comp f sin); [rate_of other | apply derivable_pt_lim_sin]
  | |- derivable_pt_lim (fun x => cos (@?f x)) _ _ => apply (derivable_pt_lim_comp f cos); [rate_of other | apply derivable_pt_lim_cos]
  | |- derivable_pt_lim (fun x => ratio (@?f x)) _ _ => apply (derivable_pt_lim_comp f ratio); [rate_of other | other]
  | _ => eassumption
  end.

(* |y cos y - sin y| <= y^2 / 2: the rate of y^2 / 2 less either is y (1 - s sin y) *)
Lemma rise_bound : forall s y, -1 <= s <= 1 -> 0 < y -> s * (sin y - y * cos y) <= 1 / 2 * (y * y).
Proof.
  intros s y S Y.
  destruct (MVT_cor2 (fun z => 1 / 2 * (z * z) - s * (sin z - z * cos z)) (fun z => z - s * (z * sin z)) 0 y Y) as [c [E C]].
  - intros c _. eapply (eq_ind _ (derivable_pt_lim _ c)); [rate_of ltac:(fail) |]. simpl. field.
  - rewrite sin_0 in E. pose proof (SIN_bound c).
    assert (0 <= (c - s * (c * sin c)) * (y - 0)).
    { apply Rmult_le_pos; [| lra]. replace (c - s * (c * sin c)) with (c * (1 - s * sin c)) by ring. apply Rmult_le_pos; [lra | nra]. }
    lra.
Qed.

Definition ratio_rate (h : R) : R := if Rlt_dec (Rabs h) small then - h / 3 else (h * cos h - sin h) / (h * h).

Lemma ratio_rate_bound : forall h, Rabs (ratio_rate h) <= 1 / 2.
Proof.
  assert (P : forall h, 0 < h -> Rabs ((h * cos h - sin h) / (h * h)) <= 1 / 2).
  { intros h H. assert (0 < h * h) by nra. pose proof (rise_bound 1 h ltac:(lra) H). pose proof (rise_bound (-1) h ltac:(lra) H).
    apply Rabs_le. split; apply Rmult_le_reg_r with (h * h); try assumption;
    replace ((h * cos h - sin h) / (h * h) * (h * h)) with (h * cos h - sin h) by (field; lra); lra. }
  intro h. unfold ratio_rate. destruct (Rlt_dec (Rabs h) small) as [L | G].
  - pose proof small_bounds. apply Rabs_def2 in L. apply Rabs_le. lra.
  - destruct (Rtotal_order h 0) as [N | [-> | N]].
    + pose proof (P (- h) ltac:(lra)) as Q. rewrite cos_neg, sin_neg in Q.
      replace ((- h * cos h - - sin h) / (- h * - h)) with (- ((h * cos h - sin h) / (h * h))) in Q by (field; lra).
      rewrite Rabs_Ropp in Q. exact Q.
    + rewrite Rabs_R0 in G. pose proof small_bounds. lra.
    + apply P. exact N.
Qed.

Lemma ratio_turns : forall h, Rabs h <> small -> derivable_pt_lim ratio h (ratio_rate h).
Proof.
  intros h N. pose proof small_bounds as SB. unfold ratio_rate. destruct (Rlt_dec (Rabs h) small) as [L | G].
  - apply Rabs_def2 in L. apply derivable_pt_lim_locally_ext with (f := fun z => 1 - 1 / 6 * (z * z)) (a := - small) (b := small).
    + lra.
    + intros z Z. unfold ratio. destruct (Rlt_dec (Rabs z) small) as [_ | F]; [field |]. exfalso. apply F. apply Rabs_def1; lra.
    + eapply (eq_ind _ (derivable_pt_lim _ h)); [rate_of ltac:(fail) |]. simpl. field.
  - assert (D : small < Rabs h) by lra.
    assert (Z : h <> 0). { intros ->. rewrite Rabs_R0 in D. lra. }
    assert (F : derivable_pt_lim (fun z => sin z / z) h ((h * cos h - sin h) / (h * h))).
    { eapply (eq_ind _ (derivable_pt_lim _ h)); [apply (derivable_pt_lim_div sin (fun z => z)); [apply derivable_pt_lim_sin | apply derivable_pt_lim_id | exact Z] |].
      unfold Rsqr. field. exact Z. }
    assert (E : forall z, small < Rabs z -> sin z / z = ratio z). { intros z K. unfold ratio. destruct (Rlt_dec (Rabs z) small); [lra | reflexivity]. }
    destruct (Rlt_dec 0 h) as [P | M].
    + rewrite Rabs_right in D by lra. apply derivable_pt_lim_locally_ext with (f := fun z => sin z / z) (a := small) (b := h + 1); [lra | | exact F].
      intros z K. apply E. rewrite Rabs_right; lra.
    + rewrite Rabs_left in D by lra. apply derivable_pt_lim_locally_ext with (f := fun z => sin z / z) (a := h - 1) (b := - small); [lra | | exact F].
      intros z K. apply E. rewrite Rabs_left; lra.
Qed.

Lemma along : forall a b c x y z, (a * x + b * y + c * z) * (a * x + b * y + c * z) <= (a * a + b * b + c * c) * (x * x + y * y + z * z).
Proof.
  intros. pose proof (Rle_0_sqr (a * y - b * x)). pose proof (Rle_0_sqr (a * z - c * x)). pose proof (Rle_0_sqr (b * z - c * y)).
  unfold Rsqr in *. lra.
Qed.

(* three directions at right angles *)
Lemma frame : forall c1 s1 c2 s2 a b c, s1 * s1 + c1 * c1 = 1 -> s2 * s2 + c2 * c2 = 1 ->
  let x := a * c1 - b * s1 in let y := a * (s2 * s1) + b * (s2 * c1) + c * c2 in let z := a * (c2 * s1) + b * (c2 * c1) - c * s2 in
  x * x + y * y + z * z = a * a + b * b + c * c.
Proof.
  intros c1 s1 c2 s2 a b c E1 E2 x y z. unfold x, y, z.
  transitivity ((a * c1 - b * s1) * (a * c1 - b * s1) + (s2 * s2 + c2 * c2) * ((a * s1 + b * c1) * (a * s1 + b * c1) + c * c)); [ring |].
  rewrite E2. transitivity ((s1 * s1 + c1 * c1) * (a * a + b * b) + c * c); [ring |]. rewrite E1. ring.
Qed.

Lemma scaled_square : forall k x c, - c <= k <= c -> (k * x) * (k * x) <= c * c * (x * x).
Proof. intros k x c K. assert (0 <= x * x) by apply Rle_0_sqr. assert (k * k <= c * c) by nra. nra. Qed.

Theorem B_rate_holds : B_rate.
Proof.
  unfold B_rate. intros a1 a2 w1 w2 t g1 g2 h1 h2 r1 r2 r3 A1 A2 W1 W2 N1 N2.
  fold small in N1, N2.
  set (p := ratio (1 / 2 * (w1 t - a1 t))). set (q := ratio (1 / 2 * (w2 t - a2 t))).
  set (p' := ratio_rate (1 / 2 * (w1 t - a1 t)) * (1 / 2 * (h1 - g1))). set (q' := ratio_rate (1 / 2 * (w2 t - a2 t)) * (1 / 2 * (h2 - g2))).
  set (m := 1 / 2 * (w1 t + a1 t)). set (n := 1 / 2 * (w2 t + a2 t)). set (m' := 1 / 2 * (h1 + g1)). set (n' := 1 / 2 * (h2 + g2)).
  set (k := cos (w1 t) * q). set (k' := cos (w1 t) * q' - sin (w1 t) * (h1 * q)).
  set (x := p' * cos m - p * m' * sin m).
  set (y := p' * (sin (a2 t) * sin m) + p * m' * (sin (a2 t) * cos m) + p * sin m * g2 * cos (a2 t)).
  set (z := p' * (cos (a2 t) * sin m) + p * m' * (cos (a2 t) * cos m) - p * sin m * g2 * sin (a2 t)).
  exists (- (x * r1 + y * r2 + z * r3)), ((k' * cos n - k * n' * sin n) * r2 + (- (k' * sin n + k * n' * cos n)) * r3).
  split; [| split].
  - eapply (eq_ind _ (derivable_pt_lim _ t)).
    + apply derivable_pt_lim_ext with (f := fun s => - ratio (1 / 2 * (w1 s - a1 s)) * cos (1 / 2 * (w1 s + a1 s)) * r1
        + - ratio (1 / 2 * (w1 s - a1 s)) * (sin (a2 s) * sin (1 / 2 * (w1 s + a1 s))) * r2
        + - ratio (1 / 2 * (w1 s - a1 s)) * (cos (a2 s) * sin (1 / 2 * (w1 s + a1 s))) * r3).
      * intro s. reflexivity.
      * rate_of ltac:(apply ratio_turns; exact N1).
    + fold p q m n. unfold x, y, z, p', m'. ring.
  - eapply (eq_ind _ (derivable_pt_lim _ t)).
    + apply derivable_pt_lim_ext with (f := fun s => cos (w1 s) * ratio (1 / 2 * (w2 s - a2 s)) * cos (1 / 2 * (w2 s + a2 s)) * r2
        + - (cos (w1 s) * ratio (1 / 2 * (w2 s - a2 s))) * sin (1 / 2 * (w2 s + a2 s)) * r3).
      * intro s. unfold ratio, small. ring.
      * rate_of ltac:(apply ratio_turns; exact N2).
    + fold p q m n. unfold k, k', q', n'. ring.
  - pose proof (circle m) as CM. pose proof (circle n) as CN. pose proof (circle (a2 t)) as CA. pose proof (circle (w1 t)) as CW.
    assert (PB : -1 <= p <= 1) by apply ratio_bound. assert (QB : -1 <= q <= 1) by apply ratio_bound.
    pose proof (Rabs_within _ _ (ratio_rate_bound (1 / 2 * (w1 t - a1 t)))) as PR. pose proof (Rabs_within _ _ (ratio_rate_bound (1 / 2 * (w2 t - a2 t)))) as QR.
    assert (P2 : p' * p' <= 1 / 2 * (1 / 2) * ((1 / 2 * (h1 - g1)) * (1 / 2 * (h1 - g1)))) by (apply scaled_square; exact PR).
    assert (Q2 : q' * q' <= 1 / 2 * (1 / 2) * ((1 / 2 * (h2 - g2)) * (1 / 2 * (h2 - g2)))) by (apply scaled_square; exact QR).
    assert (M2 : (p * m') * (p * m') <= 1 * 1 * (m' * m')) by (apply scaled_square; exact PB).
    assert (S2 : (p * sin m * g2) * (p * sin m * g2) <= 1 * 1 * (g2 * g2)).
    { apply scaled_square. apply product_bound; [exact PB | apply sine_bounds]. }
    assert (N2' : (k * n') * (k * n') <= 1 * 1 * (n' * n')).
    { apply scaled_square. apply product_bound; [apply cosine_bounds | exact QB]. }
    assert (H2 : (q * h1) * (q * h1) <= 1 * 1 * (h1 * h1)) by (apply scaled_square; exact QB).
    assert (K2 : k' * k' <= q' * q' + (q * h1) * (q * h1)).
    { pose proof (along (cos (w1 t)) (- sin (w1 t)) 0 q' (q * h1) 0) as C.
      replace (cos (w1 t) * q' + - sin (w1 t) * (q * h1) + 0 * 0) with k' in C by (unfold k'; ring).
      replace (cos (w1 t) * cos (w1 t) + - sin (w1 t) * - sin (w1 t) + 0 * 0) with 1 in C by lra. lra. }
    pose proof (frame (cos m) (sin m) (cos (a2 t)) (sin (a2 t)) p' (p * m') (p * sin m * g2) CM CA) as X. simpl in X. fold x y z in X.
    pose proof (along x y z r1 r2 r3) as F. rewrite X in F.
    pose proof (along (k' * cos n - k * n' * sin n) (- (k' * sin n + k * n' * cos n)) 0 r2 r3 0) as G.
    replace ((k' * cos n - k * n' * sin n) * (k' * cos n - k * n' * sin n) + - (k' * sin n + k * n' * cos n) * - (k' * sin n + k * n' * cos n) + 0 * 0)
      with ((sin n * sin n + cos n * cos n) * (k' * k' + (k * n') * (k * n'))) in G by ring.
    rewrite CN in G.
    set (R2 := r1 * r1 + r2 * r2 + r3 * r3) in *. assert (RP : 0 <= r2 * r2 + r3 * r3 <= R2) by (unfold R2; pose proof (Rle_0_sqr r1); pose proof (Rle_0_sqr r2); pose proof (Rle_0_sqr r3); unfold Rsqr in *; lra).
    set (S := h1 * h1 + h2 * h2 + (g1 * g1 + g2 * g2)).
    set (U := p' * p' + p * m' * (p * m') + p * sin m * g2 * (p * sin m * g2)) in *. set (V := k' * k' + k * n' * (k * n')) in *.
    assert (UV : U + V <= 13 / 8 * S).
    { pose proof (Rle_0_sqr (h1 + g1)). pose proof (Rle_0_sqr (h1 - g1)). pose proof (Rle_0_sqr (h2 + g2)). pose proof (Rle_0_sqr (h2 - g2)). pose proof (Rle_0_sqr g1). pose proof (Rle_0_sqr h2).
      unfold Rsqr in *. assert (ME : m' * m' = 1 / 4 * ((h1 + g1) * (h1 + g1))) by (unfold m'; field).
      assert (NE : n' * n' = 1 / 4 * ((h2 + g2) * (h2 + g2))) by (unfold n'; field).
      rewrite ME in M2. rewrite NE in N2'. unfold U, V, S. clear - P2 Q2 M2 S2 N2' H2 K2 H H0 H1 H3 H4 H5. lra. }
    assert (VP : 0 <= V) by (unfold V; pose proof (Rle_0_sqr k'); pose proof (Rle_0_sqr (k * n')); unfold Rsqr in *; lra).
    assert (DD : - (x * r1 + y * r2 + z * r3) * - (x * r1 + y * r2 + z * r3)
        + ((k' * cos n - k * n' * sin n) * r2 + - (k' * sin n + k * n' * cos n) * r3) * ((k' * cos n - k * n' * sin n) * r2 + - (k' * sin n + k * n' * cos n) * r3)
        <= 13 / 8 * S * R2).
    { assert (V * (r2 * r2 + r3 * r3) <= V * R2) by (apply Rmult_le_compat_l; lra).
      assert ((U + V) * R2 <= 13 / 8 * S * R2) by (apply Rmult_le_compat_r; lra). lra. }
    set (H := sqrt (h1 * h1 + h2 * h2)). set (J := sqrt (g1 * g1 + g2 * g2)).
    assert (HH : H * H = h1 * h1 + h2 * h2) by (apply sqrt_sqrt; pose proof (Rle_0_sqr h1); pose proof (Rle_0_sqr h2); unfold Rsqr in *; lra).
    assert (JJ : J * J = g1 * g1 + g2 * g2) by (apply sqrt_sqrt; pose proof (Rle_0_sqr g1); pose proof (Rle_0_sqr g2); unfold Rsqr in *; lra).
    assert (HP : 0 <= H) by apply sqrt_pos. assert (JP : 0 <= J) by apply sqrt_pos. assert (HJ : 0 <= H * J) by (apply Rmult_le_pos; assumption).
    replace (32 / 25 * (H + J) * sqrt R2) with (sqrt (32 / 25 * (32 / 25) * ((H + J) * (H + J)) * R2)).
    + apply sqrt_le_1_alt. eapply Rle_trans; [exact DD |]. apply Rmult_le_compat_r; [lra |]. unfold S. rewrite <- HH, <- JJ.
      pose proof (Rle_0_sqr H). pose proof (Rle_0_sqr J). unfold Rsqr in *. lra.
    + replace (32 / 25 * (32 / 25) * ((H + J) * (H + J)) * R2) with (Rsqr (32 / 25 * (H + J)) * R2) by (unfold Rsqr; ring).
      rewrite sqrt_mult by (try apply Rle_0_sqr; lra). rewrite sqrt_Rsqr by lra. reflexivity.
Qed.
