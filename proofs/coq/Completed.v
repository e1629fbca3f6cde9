(* L along the closed loop of the completed law: T9 and T10. *)
From Coq Require Import Reals Lra.
Require Import Basics Functions Norms Statements Plant.
Open Scope R_scope.

Lemma cancelled : forall a d, d <> 0 -> a * d * (1 / d) = a.
Proof. intros. field. assumption. Qed.

Theorem T9_all_holds : T9_all.
Proof.
  unfold T9_all. intros * L. unfold completed_loop in L. destruct L as [P L]. parts.
  said outer_loop_holds of P as Out. destruct Out as [A1 [A2 A3]].
  said inner_loop_holds of P as In. destruct In as [N1 [N2 N3]].
  assert (K : rb1 * (jd11 * rb1 + jd12 * rb2 + jd13 * rb3) + rb2 * (jd21 * rb1 + jd22 * rb2 + jd23 * rb3) + rb3 * (jd31 * rb1 + jd32 * rb2 + jd33 * rb3)
    = 2 * (rb1 * (c11 * rb1 + c12 * rb2 + c13 * rb3) + rb2 * (c21 * rb1 + c22 * rb2 + c23 * rb3) + rb3 * (c31 * rb1 + c32 * rb2 + c33 * rb3))).
  { pose proof skew_holds as S. unfold skew in S. eapply S. exact P. }
  clear P.
  assert (Z1 : yawr = rb1 - lb1 * e1 + q1) by (unfolded rb1; ring). assert (Z2 : zr1 = rb2 - c1 - lb2 * e2 + q2) by (unfolded rb2; ring).
  assert (Z3 : zr2 = rb3 - c2 - lb3 * e3 + q3) by (unfolded rb3; ring).
  assert (B1 : j11 * rbd1 + j12 * rbd2 + j13 * rbd3 = j11 * (lb1 * rb1) + j12 * (lb2 * rb2) + j13 * (lb3 * rb3) - (c11 * rb1 + c12 * rb2 + c13 * rb3)
    + ((wb11 - ub11) * mub1 + (wb21 - ub21) * mub2) + db1 - kb1 * rb1 - ib1 * nb1 - pp1 * e1).
  { transitivity (j11 * (rbd1 + acc1) + j12 * (rbd2 + acc2) + j13 * (rbd3 + acc3) + (c11 * q1 + c12 * q2 + c13 * q3)
      - (j11 * acc1 + j12 * acc2 + j13 * acc3 + (c11 * q1 + c12 * q2 + c13 * q3))); [ring |].
    rewrite N1. unfolded b1. unfolded tau1. unfolded rbd1. unfolded rbd2. unfolded rbd3. rewrite Z1, Z2, Z3. ring. }
  assert (B2 : j21 * rbd1 + j22 * rbd2 + j23 * rbd3 = j21 * (lb1 * rb1) + j22 * (lb2 * rb2) + j23 * (lb3 * rb3) - (c21 * rb1 + c22 * rb2 + c23 * rb3)
    + ((wb12 - ub12) * mub1 + (wb22 - ub22) * mub2) + db2 - kb2 * rb2 - ib2 * nb2 - pp2 * e2).
  { transitivity (j21 * (rbd1 + acc1) + j22 * (rbd2 + acc2) + j23 * (rbd3 + acc3) + (c21 * q1 + c22 * q2 + c23 * q3)
      - (j21 * acc1 + j22 * acc2 + j23 * acc3 + (c21 * q1 + c22 * q2 + c23 * q3))); [ring |].
    rewrite N2. unfolded b2. unfolded tau2. unfolded rbd1. unfolded rbd2. unfolded rbd3. rewrite Z1, Z2, Z3. ring. }
  assert (B3 : j31 * rbd1 + j32 * rbd2 + j33 * rbd3 = j31 * (lb1 * rb1) + j32 * (lb2 * rb2) + j33 * (lb3 * rb3) - (c31 * rb1 + c32 * rb2 + c33 * rb3)
    + ((wb13 - ub13) * mub1 + (wb23 - ub23) * mub2) + db3 - kb3 * rb3 - ib3 * nb3 - pp3 * e3).
  { transitivity (j31 * (rbd1 + acc1) + j32 * (rbd2 + acc2) + j33 * (rbd3 + acc3) + (c31 * q1 + c32 * q2 + c33 * q3)
      - (j31 * acc1 + j32 * acc2 + j33 * acc3 + (c31 * q1 + c32 * q2 + c33 * q3))); [ring |].
    rewrite N3. unfolded b3. unfolded tau3. unfolded rbd1. unfolded rbd2. unfolded rbd3. rewrite Z1, Z2, Z3. ring. }
  (* what the counter-rate's filter was fed *)
  assert (M : 1 - decay * (1 + w * period) <> 0) by (unfolded decay; apply passed; apply Rmult_lt_0_compat; assumption).
  assert (G2 : pp2 * raw2 = u * (bt1 * ra1 + bt2 * ra2 + bt3 * ra3)).
  { unfolded raw2. match goal with |- _ * (?fed * (1 / ?d)) = _ => replace fed with (own1 * d) by ring; rewrite (cancelled own1 d M) end.
    unfolded own1. field. not_zero. }
  assert (G3 : pp3 * raw3 = u * (0 * ra1 + bp2 * ra2 + bp3 * ra3)).
  { unfolded raw3. match goal with |- _ * (?fed * (1 / ?d)) = _ => replace fed with (own2 * d) by ring; rewrite (cancelled own2 d M) end.
    unfolded own2. field. not_zero. }
  (* nothing is projected *)
  assert (K0 : keep0 = 1) by (unfolded keep0; destruct (Rgt_dec size0 nmax1) as [above | below]; [exfalso; apply (Rgt_not_le _ _ above); assumption | reflexivity]).
  assert (K1 : keep1 = 1) by (unfolded keep1; destruct (Rgt_dec size1 nmax2) as [above | below]; [exfalso; apply (Rgt_not_le _ _ above); assumption | reflexivity]).
  assert (K2 : keep2 = 1) by (unfolded keep2; destruct (Rgt_dec size2 wmax1) as [above | below]; [exfalso; apply (Rgt_not_le _ _ above); assumption | reflexivity]).
  assert (K3 : keep3 = 1) by (unfolded keep3; destruct (Rgt_dec size3 wmax2) as [above | below]; [exfalso; apply (Rgt_not_le _ _ above); assumption | reflexivity]).
  rewrite K0, K1, K2, K3, Z1, Z2, Z3.
  match goal with |- ?t1 + ?t2 + ?t3 + ?t4 + ?t5 + ?t6 + ?t7 + ?t8 = _ =>
    replace t1 with (ra1 * (m * rad1) + ra2 * (m * rad2) + ra3 * (m * rad3)) by ring; rewrite A1, A2, A3, B1, B2, B3, K;
    replace t5 with (na1 * (ia1 * ra1) + na2 * (ia2 * ra2) + na3 * (ia3 * ra3)) by (field; not_zero);
    replace t6 with (nb1 * (ib1 * rb1) + nb2 * (ib2 * rb2) + nb3 * (ib3 * rb3)) by (field; not_zero);
    replace t7 with (kappa * n * ((wa11 - ua11) * ua11 + (wa12 - ua12) * ua12 + (wa13 - ua13) * ua13 + (wa21 - ua21) * ua21 + (wa22 - ua22) * ua22 + (wa23 - ua23) * ua23)
      - (ra1 * ((wa11 - ua11) * mua1 + (wa21 - ua21) * mua2) + ra2 * ((wa12 - ua12) * mua1 + (wa22 - ua22) * mua2) + ra3 * ((wa13 - ua13) * mua1 + (wa23 - ua23) * mua2)))
      by (field; split; not_zero);
    replace t8 with (kappa * n * ((wb11 - ub11) * ub11 + (wb12 - ub12) * ub12 + (wb13 - ub13) * ub13 + (wb21 - ub21) * ub21 + (wb22 - ub22) * ub22 + (wb23 - ub23) * ub23)
      - (rb1 * ((wb11 - ub11) * mub1 + (wb21 - ub21) * mub2) + rb2 * ((wb12 - ub12) * mub1 + (wb22 - ub22) * mub2) + rb3 * ((wb13 - ub13) * mub1 + (wb23 - ub23) * mub2)))
      by (field; split; not_zero)
  end.
  replace (e2 * (pp2 * (raw2 - c1))) with (e2 * (pp2 * raw2) - e2 * (pp2 * c1)) by ring. rewrite G2.
  replace (e3 * (pp3 * (raw3 - c2))) with (e3 * (pp3 * raw3) - e3 * (pp3 * c2)) by ring. rewrite G3.
  match goal with |- context [1 / 2 * (2 * ?x)] => replace (1 / 2 * (2 * x)) with x by field end.
  ring.
Qed.

Theorem T9_holds : T9.
Proof.
  unfold T9. intros * L A B. said T9_all_holds of L as E. rewrite E. clear E.
  unfold completed_loop in L. destruct L as [P _]. said no_series_holds of P as S; try assumption.
  destruct S as [S1 [S2 S3]]. rewrite S1, S2, S3. match goal with |- ?i + ?x = _ => replace x with 0 by ring end. apply Rplus_0_r.
Qed.

Theorem T9_near_holds : T9_near.
Proof.
  unfold T9_near. intros * L. said T9_all_holds of L as E. rewrite E. clear E.
  unfold completed_loop in L. destruct L as [P _]. said thrust_holds of P as U. said series_holds of P as S. destruct S as [S1 [S2 S3]].
  match goal with |- Rabs (?i + ?x - ?i) <= _ => replace (i + x - i) with x by ring end. apply left_by_series; assumption.
Qed.

(* the terms of the identity against those of the bound *)
Lemma bounded_completed : forall i1 i2 i3 i4 i5 i6 i7 i8 x b1 b2 b3 b4 b5 b6 b7 b8 b9 y, i1 <= b1 -> i2 <= b2 + b3 -> i3 <= b4 -> i4 + i5 <= b5 ->
  i6 <= b6 -> i7 <= b7 + b8 -> i8 <= b9 -> x <= y ->
  i1 + i2 + i3 + i4 + i5 + i6 + i7 + i8 + x <= b1 + b2 + b3 + b4 + b5 + b6 + b7 + b8 + b9 + y.
Proof. intros. lra. Qed.

Theorem T10_holds : T10.
Proof.
  unfold T10. intros * L. intros. said T9_all_holds of L as E. rewrite E. clear E.
  unfold completed_loop in L. destruct L as [P L]. assert (F : n = sqrt (ra1 * ra1 + ra2 * ra2 + ra3 * ra3 + (rb1 * rb1 + rb2 * rb2 + rb3 * rb3)) /\ 0 < pp1)
    by (parts; split; [assumption | apply Rgt_lt; assumption]). destruct F as [NN PP]. clear L.
  said thrust_holds of P as U.
  match goal with H : least1 = _ |- _ => destruct (least_of_three _ _ _ _ H) as [D1 [D2 D3]] end.
  match goal with H : least2 = _ |- _ => destruct (least_of_three _ _ _ _ H) as [K1 [K2 K3]] end.
  match goal with H : leastp = _ |- _ => destruct (least_of_three _ _ _ _ H) as [L1 [L2 L3]] end.
  match goal with H : most2 = _ |- _ => destruct (most_of_three _ _ _ _ H) as [M1 [M2 M3]] end.
  match goal with H : sigma = _ |- _ => destruct (most_of_three _ _ _ _ H) as [S1 [S2 S3]] end.
  apply bounded_completed.
  - apply (weighted_length _ (ka1 - m * la1) (ka2 - m * la2) (ka3 - m * la3)); assumption.
  - assert (G : (least2 - 2 * sigma * most2) * (rb1 * rb1 + rb2 * rb2 + rb3 * rb3) <= rb1 * (kb1 * rb1) + rb2 * (kb2 * rb2) + rb3 * (kb3 * rb3)
      - (rb1 * (j11 * (lb1 * rb1) + j12 * (lb2 * rb2) + j13 * (lb3 * rb3)) + rb2 * (j21 * (lb1 * rb1) + j22 * (lb2 * rb2) + j23 * (lb3 * rb3))
         + rb3 * (j31 * (lb1 * rb1) + j32 * (lb2 * rb2) + j33 * (lb3 * rb3)))).
    { pose proof gain_holds as G. unfold gain in G. eapply G; try eassumption. }
    match goal with H : len2 = _ |- _ => pose proof (length_square _ _ _ _ H) as Q end. rewrite <- Q in G.
    match type of G with _ <= ?a - ?b => set (X := a) in *; set (Y := b) in * end. clearbody X Y. lra.
  - match goal with |- - ?t <= _ => replace t with (e1 * (pp1 * lb1 * e1) + e2 * (pp2 * lb2 * e2) + e3 * (pp3 * lb3 * e3)) by ring end.
    apply weighted_length; assumption.
  - apply cauchy6; assumption.
  - apply cauchy3; assumption.
  - match goal with |- _ <= ?k * ?we * ?wi + - _ => replace (k * we * wi + - (k * we * we)) with (k * (we * wi - we * we)) by ring end.
    apply Rmult_le_compat_l.
    + apply Rmult_le_pos; [lra |]. rewrite NN. apply sqrt_pos.
    + apply forgetting; assumption.
  - apply cauchy3; assumption.
  - said series_holds of P as S. destruct S as [Y1 [Y2 Y3]]. eapply Rle_trans; [apply Rle_abs | apply left_by_series; assumption].
Qed.
