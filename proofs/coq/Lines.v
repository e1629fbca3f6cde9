(* The lines of Q and d in Theorem B: what the loop's equations make of L_dot, term by term. *)
From Coq Require Import Reals Lra Psatz.
Require Import Basics Functions Norms Statements.
Open Scope R_scope.

Lemma dot_add : forall a b c, dot a (add b c) = dot a b + dot a c.
Proof. intros. unfold dot, add. simpl. ring. Qed.

Lemma dot_scale : forall k a b, dot a (scale k b) = k * dot a b.
Proof. intros. unfold dot, scale. simpl. ring. Qed.

Lemma dot_swap : forall a b, dot a b = dot b a.
Proof. intros. unfold dot. ring. Qed.

Lemma len_positive : forall a, 0 <= len a.
Proof. intro. apply sqrt_pos. Qed.

Lemma len_square : forall a, dot a a = len a * len a.
Proof. intro. unfold len. rewrite sqrt_sqrt; [reflexivity |]. unfold dot. pose proof (Rle_0_sqr (first a)). pose proof (Rle_0_sqr (second a)). pose proof (Rle_0_sqr (third a)). unfold Rsqr in *. lra. Qed.

Lemma dot_most : forall a b, dot a b <= len a * len b.
Proof. intros. unfold dot, len. apply cauchy3; reflexivity. Qed.

Lemma len_scale : forall k a, len (scale k a) = Rabs k * len a.
Proof.
  intros. unfold len. rewrite <- sqrt_Rsqr_abs, <- sqrt_mult.
  - f_equal. unfold dot, scale, Rsqr. simpl. ring.
  - apply Rle_0_sqr.
  - rewrite len_square. apply Rle_0_sqr.
Qed.

Lemma dot_least : forall a b, - dot a b <= len a * len b.
Proof.
  intros. pose proof (dot_most a (scale (-1) b)) as H. rewrite dot_scale, len_scale in H.
  rewrite Rabs_left in H by lra. lra.
Qed.

Lemma len_add : forall a b, len (add a b) <= len a + len b.
Proof.
  intros. pose proof (len_positive a). pose proof (len_positive b). pose proof (len_positive (add a b)).
  apply Rsqr_incr_0_var; [| lra]. unfold Rsqr. rewrite <- len_square, dot_add, (dot_swap _ a), (dot_swap _ b), !dot_add, (dot_swap b a), !len_square.
  pose proof (dot_most a b). lra.
Qed.

Lemma sum_within : forall a b x y, len a <= x -> len b <= y -> len (add a b) <= x + y.
Proof. intros. pose proof (len_add a b). lra. Qed.

Lemma multiple_within : forall k c a x, - c <= k <= c -> len a <= x -> len (scale k a) <= c * x.
Proof.
  intros k c a x K X. rewrite len_scale. apply Rmult_le_compat; [apply Rabs_pos | apply len_positive | | exact X].
  apply Rabs_le. exact K.
Qed.

Lemma weighed : forall k a b x y, 0 <= k -> len a <= x -> len b <= y -> k * dot a b <= k * (x * y).
Proof.
  intros. apply Rmult_le_compat_l; [assumption |]. eapply Rle_trans; [apply dot_most |].
  apply Rmult_le_compat; try apply len_positive; assumption.
Qed.

Lemma weighed_below : forall k a b x y, 0 <= k -> len a <= x -> len b <= y -> - (k * dot a b) <= k * (x * y).
Proof.
  intros. replace (- (k * dot a b)) with (k * - dot a b) by ring. apply Rmult_le_compat_l; [assumption |].
  eapply Rle_trans; [apply dot_least |]. apply Rmult_le_compat; try apply len_positive; assumption.
Qed.

Lemma equal_vectors : forall a b, first a = first b -> second a = second b -> third a = third b -> a = b.
Proof. intros [a1 a2 a3] [b1 b2 b3]. simpl. intros -> -> ->. reflexivity. Qed.

Lemma discriminant : forall a b c, 0 <= c -> (forall t, 0 <= a + 2 * (t * b) + t * t * c) -> b * b <= a * c.
Proof.
  intros a b c [C | <-] H.
  - pose proof (H (- b / c)) as Q. replace (a + 2 * (- b / c * b) + - b / c * (- b / c) * c) with ((a * c - b * b) / c) in Q by (field; lra).
    apply Rmult_le_compat_r with (r := c) in Q; [| lra]. replace ((a * c - b * b) / c * c) with (a * c - b * b) in Q by (field; lra). lra.
  - destruct (Req_dec b 0) as [-> | N]; [lra |]. pose proof (H (- (a + 1) / (2 * b))) as Q.
    replace (a + 2 * (- (a + 1) / (2 * b) * b) + - (a + 1) / (2 * b) * (- (a + 1) / (2 * b)) * 0) with (-1) in Q by (field; exact N). lra.
Qed.

Lemma dot_pencil : forall a b c d t, dot (add a (scale t b)) (add c (scale t d)) = dot a c + t * dot a d + t * dot b c + t * t * dot b d.
Proof. intros. unfold dot, add, scale. simpl. ring. Qed.

(* |k - l J| <= k where 0 <= l J <= k *)
Lemma damping_within : forall (J : vec -> vec) k l high a b, (forall x y t, J (add x (scale t y)) = add (J x) (scale t (J y))) ->
  (forall x y, dot x (J y) = dot (J x) y) -> (forall x, 0 <= dot x (J x) <= high * dot x x) -> 0 <= k -> 0 <= l -> l * high <= k ->
  - (k * dot a b - l * dot a (J b)) <= len a * (k * len b).
Proof.
  intros J k l high a b JL JS JB K L H.
  assert (Q : forall x, 0 <= k * dot x x - l * dot x (J x) <= k * dot x x).
  { intro x. pose proof (JB x) as [X Y]. assert (0 <= dot x x) by (rewrite len_square; apply Rle_0_sqr).
    assert (0 <= l * dot x (J x)) by (apply Rmult_le_pos; lra). assert (l * dot x (J x) <= l * (high * dot x x)) by (apply Rmult_le_compat_l; lra).
    assert (l * high * dot x x <= k * dot x x) by (apply Rmult_le_compat_r; lra). lra. }
  set (n := k * dot a b - l * dot a (J b)).
  assert (D : n * n <= (k * dot a a - l * dot a (J a)) * (k * dot b b - l * dot b (J b))).
  { apply discriminant; [apply Q |]. intro t. pose proof (proj1 (Q (add a (scale t b)))) as Z. rewrite JL in Z.
    rewrite !dot_pencil in Z.
    rewrite (dot_swap b a) in Z. replace (dot b (J a)) with (dot a (J b)) in Z by (rewrite JS, dot_swap; reflexivity). unfold n. lra. }
  pose proof (Q a) as [A1 A2]. pose proof (Q b) as [B1 B2]. rewrite !len_square in *. pose proof (len_positive a). pose proof (len_positive b).
  assert (S : n * n <= (len a * (k * len b)) * (len a * (k * len b))).
  { eapply Rle_trans; [exact D |]. eapply Rle_trans; [apply Rmult_le_compat; [exact A1 | exact B1 | exact A2 | exact B2] |]. right. ring. }
  assert (P : 0 <= len a * (k * len b)) by (repeat apply Rmult_le_pos; lra).
  apply Rsqr_incr_0_var; [| exact P]. unfold Rsqr. lra.
Qed.

Theorem T18_lines_holds : T18_lines.
Proof.
  unfold T18_lines. intros until J.
  intros M P FZ C1 C2 COL FO HI I1P I2P JM K1 K2 L1 L2 PA PB PC PD QP RM RA SI TO UP WP K.
  intros R E CE CR CS JE2 BACK F CD T TH TU DF BE TD CM B1 B1D BT JL JS JB JK CC OM EP1 EP2 JE R1.
  set (k := k1 - m * l1) in *. set (n1 := len r1) in *. set (ni := len I1) in *. set (ne := len e1) in *. set (n2 := len e2) in *.
  set (nr := len r2) in *. set (nj := len I2) in *. set (na := len a) in *. set (nb := len b) in *. set (nc := len a_c) in *. set (nd := len b_c) in *.
  assert (N1 : 0 <= n1) by apply len_positive. assert (NI : 0 <= ni) by apply len_positive. assert (NE : 0 <= ne) by apply len_positive.
  assert (N2 : 0 <= n2) by apply len_positive. assert (NR2 : 0 <= nr) by apply len_positive. assert (NJ : 0 <= nj) by apply len_positive.
  assert (NA : 0 <= na) by apply len_positive. assert (NB : 0 <= nb) by apply len_positive. assert (NC : 0 <= nc) by apply len_positive.
  assert (ND : 0 <= nd) by apply len_positive.
  pose proof (proj2 (JB r2)) as JR.
  (* the parts of the forces *)
  assert (DU : len delta_f <= u * (na + nb)) by (eapply Rle_trans; [exact DF |]; apply Rmult_le_compat_r; lra).
  assert (BU : len (scale thrust Be2) <= u * n2) by (apply multiple_within; [lra | exact BE]).
  assert (PU : len (add delta_f (add (scale thrust Be2) eps1)) <= u * (na + nb) + (u * n2 + force)) by (repeat apply sum_within; assumption).
  set (push := u * (na + nb) + (u * n2 + force)) in *.
  (* |r1_dot| *)
  set (slow := k * n1 + (i1 * ni + push)).
  assert (RD : m * len r1_dot <= slow).
  { replace (m * len r1_dot) with (len (scale m r1_dot)) by (rewrite len_scale, Rabs_right by lra; reflexivity). rewrite R.
    apply sum_within; [apply multiple_within; [lra | apply Rle_refl] |]. apply sum_within; [apply multiple_within; [lra | apply Rle_refl] | exact PU]. }
  (* |F_dot| *)
  set (of := i1 - m * (l1 * l1) - k1 * k / m).
  set (fast := m * jerk_most + (Rabs of * n1 + (m * (l1 * l1 * l1) * ne + (k1 * i1 / m * ni + k1 / m * push)))).
  assert (KM : 0 <= k1 / m) by (apply Rmult_le_pos; [lra | apply Rlt_le, Rinv_0_lt_compat; lra]).
  assert (KI : 0 <= k1 * i1 / m) by (replace (k1 * i1 / m) with (k1 / m * i1) by (field; lra); apply Rmult_le_pos; lra).
  assert (LL : 0 <= m * (l1 * l1 * l1)) by (repeat apply Rmult_le_pos; lra).
  assert (FB : len F_dot <= fast).
  { assert (FE : F_dot = add (scale m jerk) (add (scale of r1) (add (scale (m * (l1 * l1 * l1)) e1)
      (add (scale (- (k1 * i1 / m)) I1) (scale (k1 / m) (add delta_f (add (scale thrust Be2) eps1))))))).
    { assert (RR : r1_dot = scale (/ m) (scale m r1_dot)) by (apply equal_vectors; unfold scale; simpl; field; lra).
      rewrite F, RR, R. unfold of, k. apply equal_vectors; unfold add, scale; simpl; field; lra. }
    rewrite FE. apply sum_within; [apply multiple_within; [lra | exact JE] |].
    apply sum_within; [rewrite len_scale; apply Rle_refl |]. apply sum_within; [apply multiple_within; [lra | apply Rle_refl] |].
    apply sum_within; [apply multiple_within; [lra | apply Rle_refl] |]. apply multiple_within; [lra | exact PU]. }
  assert (FP : 0 <= fast) by (eapply Rle_trans; [apply len_positive | exact FB]).
  (* the command's rate *)
  assert (CMB : len command_dot <= fast / fz).
  { apply Rmult_le_reg_r with fz; [exact FZ |]. replace (fast / fz * fz) with fast by (field; lra). lra. }
  (* the counter-rate, and the rates of the tilt *)
  assert (CRB : len c_raw <= column * u / p * n1).
  { apply Rmult_le_reg_l with p; [exact P |]. replace (p * len c_raw) with (len (scale p c_raw)) by (rewrite len_scale, Rabs_right by lra; reflexivity).
    rewrite CS. replace (p * (column * u / p * n1)) with (u * (column * n1)) by (field; lra). apply multiple_within; [lra | exact B1]. }
  assert (CB : len c <= column * u / p * n1 + (nc + nd)).
  { rewrite CE. apply sum_within; [exact CRB |]. apply sum_within; rewrite len_scale, Rabs_left by lra; unfold nc, nd; lra. }
  set (turn := w * nb + (nr + (l2 * n2 + (column * u / p * n1 + (nc + nd))))).
  assert (WB : len (scale w b) <= w * nb) by (apply multiple_within; [lra | apply Rle_refl]).
  assert (TB : len turned <= turn).
  { rewrite T, E. apply sum_within; [exact WB |]. rewrite len_scale, Rabs_left by lra.
    match goal with |- - -1 * ?x <= _ => replace (- -1 * x) with x by ring end.
    apply sum_within; [apply Rle_refl |]. apply sum_within; [apply multiple_within; [lra | apply Rle_refl] |].
    rewrite len_scale, Rabs_left by lra. lra. }
  assert (TP : 0 <= turn) by (eapply Rle_trans; [apply len_positive | exact TB]).
  assert (SP : 0 <= slow) by (eapply Rle_trans; [| exact RD]; apply Rmult_le_pos; [lra | apply len_positive]).
  set (whirl := (fast * (column * r1_most) + (u * ((32 / 25) * (w * nb + turn) * r1_most) + u * (column * (slow / m)))) / p).
  assert (CDB : len c_raw_dot <= whirl).
  { apply Rmult_le_reg_l with p; [exact P |]. replace (p * len c_raw_dot) with (len (scale p c_raw_dot)) by (rewrite len_scale, Rabs_right by lra; reflexivity).
    rewrite CD. unfold whirl. match goal with |- _ <= p * (?x / p) => replace (p * (x / p)) with x by (field; lra) end.
    apply sum_within; [| apply sum_within; apply multiple_within; try lra].
    - apply multiple_within; [apply Rabs_within; lra |]. eapply Rle_trans; [exact B1 |]. apply Rmult_le_compat_l; lra.
    - eapply Rle_trans; [exact BT |]. pose proof (len_positive (scale w b)). pose proof (len_positive turned). apply Rmult_le_compat; lra.
    - eapply Rle_trans; [exact B1D |]. apply Rmult_le_compat_l; [exact COL |].
      apply Rmult_le_reg_l with m; [exact M |]. replace (m * (slow / m)) with slow by (field; lra). exact RD. }
  (* L_dot by inner products *)
  assert (X1 : m * dot r1 r1_dot = - k * dot r1 r1 - i1 * dot I1 r1 + dot r1 delta_f + thrust * dot r1 Be2 + dot r1 eps1).
  { rewrite <- dot_scale, R, !dot_add, !dot_scale, (dot_swap r1 I1). ring. }
  assert (X2 : m * dot r1_dot I1 = - k * dot I1 r1 - i1 * dot I1 I1 + dot I1 delta_f + dot I1 (scale thrust Be2) + dot I1 eps1).
  { rewrite (dot_swap r1_dot), <- dot_scale, R, !dot_add, !(dot_scale _ I1). ring. }
  assert (X3 : p * dot e2 e2_dot = p * dot e2 r2 - p * l2 * dot e2 e2 - thrust * dot r1 Be2 + p * dot e2 a_c + p * dot e2 b_c).
  { rewrite E, !dot_add, !dot_scale, CE, !dot_add, !dot_scale, <- CR. ring. }
  assert (X4 : dot r2 J_r2_dot = l2 * dot r2 (J r2) - dot r2 C_r2 - k2 * dot r2 r2 - i2 * dot I2 r2 - p * dot e2 r2 + dot r2 eps2).
  { rewrite JE2, BACK, !dot_add, !dot_scale, (dot_swap r2 I2), (dot_swap r2 e2). ring. }
  assert (X5 : dot I2 J_r2_dot = - (k2 * dot I2 r2 - l2 * dot I2 (J r2)) - dot I2 C_r2 - i2 * dot I2 I2 - p * dot I2 e2 + dot I2 eps2).
  { rewrite JE2, BACK, !dot_add, !dot_scale. ring. }
  rewrite X1, X2, X3, X4, X5, !dot_add, !(dot_scale _ e1), !(dot_scale _ a), !(dot_scale _ b), !(dot_scale _ a_c), !(dot_scale _ b_c).
  rewrite !len_square. rewrite len_square in JR. rewrite !len_square in CC. fold n1 ni ne n2 nr nj na nb nc nd. fold nr in JR. fold nj nr in CC.
  (* each against its bound *)
  pose proof (weighed 1 r1 delta_f _ _ ltac:(lra) (Rle_refl _) DU) as Y1. pose proof (weighed 1 r1 eps1 _ _ ltac:(lra) (Rle_refl _) EP1) as Y2.
  pose proof (weighed_below (c1 * k) I1 r1 _ _ ltac:(apply Rmult_le_pos; lra) (Rle_refl _) (Rle_refl _)) as Y3.
  pose proof (weighed c1 I1 delta_f _ _ C1 (Rle_refl _) DU) as Y4. pose proof (weighed c1 I1 _ _ _ C1 (Rle_refl _) BU) as Y5.
  pose proof (weighed c1 I1 eps1 _ _ C1 (Rle_refl _) EP1) as Y6. pose proof (weighed q e1 r1 _ _ QP (Rle_refl _) (Rle_refl _)) as Y7.
  pose proof (weighed p e2 a_c _ _ ltac:(lra) (Rle_refl _) (Rle_refl _)) as Y8. pose proof (weighed p e2 b_c _ _ ltac:(lra) (Rle_refl _) (Rle_refl _)) as Y9.
  pose proof (weighed 1 r2 eps2 _ _ ltac:(lra) (Rle_refl _) EP2) as Y10.
  assert (Y11 : - (c2 * (k2 * dot I2 r2 - l2 * dot I2 (J r2))) <= c2 * (nj * (k2 * nr))).
  { pose proof (damping_within J k2 l2 high I2 r2 JL JS JB K2 L2 JK) as D. replace (- (c2 * (k2 * dot I2 r2 - l2 * dot I2 (J r2)))) with (c2 * - (k2 * dot I2 r2 - l2 * dot I2 (J r2))) by ring.
    apply Rmult_le_compat_l; [exact C2 |]. fold nj nr in D. lra. }
  pose proof (weighed_below (c2 * p) I2 e2 _ _ ltac:(apply Rmult_le_pos; lra) (Rle_refl _) (Rle_refl _)) as Y12.
  pose proof (weighed c2 I2 eps2 _ _ C2 (Rle_refl _) EP2) as Y13.
  pose proof (weighed pa a _ _ _ PA (Rle_refl _) CMB) as Y14. pose proof (weighed (pb * w) b a _ _ ltac:(apply Rmult_le_pos; lra) (Rle_refl _) (Rle_refl _)) as Y15.
  pose proof (weighed pc a_c _ _ _ PC (Rle_refl _) CDB) as Y16. pose proof (weighed (pd * w) b_c a_c _ _ ltac:(apply Rmult_le_pos; lra) (Rle_refl _) (Rle_refl _)) as Y17.
  assert (Y18 : l2 * dot r2 (J r2) <= l2 * (high * (nr * nr))) by (apply Rmult_le_compat_l; assumption).
  assert (Y19 : c2 * dot r2 (J r2) <= c2 * (high * (nr * nr))) by (apply Rmult_le_compat_l; assumption).
  assert (Y20 : c2 * dot r2 C_I2 <= c2 * (sigma * (7072 / 10000) * rates * (nj * nr))).
  { apply Rmult_le_compat_l; [exact C2 |]. apply Rsqr_incr_0_var; [| repeat apply Rmult_le_pos; lra]. unfold Rsqr.
    eapply Rle_trans; [exact CC |]. pose proof (len_positive eta_dot) as OP. set (o := len eta_dot) in *.
    assert (OO : o * o <= rates * rates) by (apply Rmult_le_compat; lra).
    assert (SS : 0 <= sigma * sigma * ((nj * nj) * (nr * nr))) by (repeat apply Rmult_le_pos; lra).
    assert (S1 : sigma * sigma * ((nj * nj) * (nr * nr)) * (o * o) <= sigma * sigma * ((nj * nj) * (nr * nr)) * (rates * rates)) by (apply Rmult_le_compat_l; assumption).
    assert (S2 : 0 <= sigma * sigma * ((nj * nj) * (nr * nr)) * (rates * rates)) by (apply Rmult_le_pos; [exact SS | apply Rmult_le_pos; lra]).
    lra. }
  fold n1 ni ne n2 nr nj na nb nc nd in Y1, Y2, Y3, Y4, Y5, Y6, Y7, Y8, Y9, Y10, Y12, Y13, Y14, Y15, Y16, Y17.
  eapply Rle_trans with (- k * (n1 * n1) + n1 * (u * (na + nb)) + n1 * force + c1 * k * (ni * n1) - c1 * i1 * (ni * ni) + c1 * (ni * (u * (na + nb)))
    + c1 * (ni * (u * n2)) + c1 * (ni * force) + c1 * m * (n1 * n1) + q * (ne * n1) - q * l1 * (ne * ne) - p * l2 * (n2 * n2) + p * (n2 * nc) + p * (n2 * nd)
    + l2 * (high * (nr * nr)) - k2 * (nr * nr) + nr * torque + c2 * (nj * (k2 * nr)) - c2 * i2 * (nj * nj) + c2 * p * (nj * n2) + c2 * (nj * torque)
    + c2 * (sigma * (7072 / 10000) * rates * (nj * nr)) + c2 * (high * (nr * nr)) + pa * (na * (fast / fz)) - pa * w * (na * na)
    + pb * w * (nb * na) - pb * w * (nb * nb) + pc * (nc * whirl) - pc * w * (nc * nc) + pd * w * (nd * nc) - pd * w * (nd * nd)).
  - lra.
  - right. unfold whirl, turn, fast, slow, push, of. field. repeat split; lra.
Qed.
