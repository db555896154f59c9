!! Linear complementarity problems: w = M z + q, 0 <= w ⟂ z >= 0, by Lemke's method with the lexicographic ratio test.
!!
!! Source: Cottle, Pang and Stone, The Linear Complementarity Problem, SIAM (2009): 4.4 (method), 4.9 (lexicographic rule).
!! Known properties, in exact arithmetic:
!! - with the lexicographic rule no basis returns, so the method ends after finitely many pivots, degenerate or not;
!! - it ends with a solution or on a ray. If M is copositive-plus (positive semidefinite, or xᵀMx >= 0 for x >= 0 with equality
!!   only where (M + Mᵀ)x = 0), a ray says that M z + q >= 0, z >= 0 has no solution at all;
!! - if M is only copositive, a solution is found whenever qᵀv >= 0 for all solutions v of the problem with q = 0;
!! - if all principal minors of M are positive (a P-matrix), the solution is unique and is found.
!! The number of pivots can grow exponentially in the worst case; it is about n in practice and is limited here.
!!
!! A positive diagonal D makes D M D and D q of even size, in powers of two and so without rounding; that keeps all the classes
!! above. What is called solved has been put into the equations given and checked.
module razy_linalg_complementarity_lemke
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use razy_core_kinds, only: wp
   implicit none(type, external)
   private

   public :: solve_complementarity
   public :: complementarity_solved, complementarity_ray, complementarity_pivot_limit
   public :: complementarity_inaccurate, complementarity_not_finite

   !> How the method ended: a solution; a ray (no solution, see above); too many pivots; a basis that does not solve the
   !> equations for rounding; an entry that is infinite or not a number.
   integer, parameter :: complementarity_solved = 0, complementarity_ray = 1, complementarity_pivot_limit = 2, &
                         complementarity_inaccurate = 3, complementarity_not_finite = 4

   !> Smaller parts of the largest entry of a column are rounding, and no pivots; ratios closer than this are equal.
   real(wp), parameter :: negligible = 4.0e3_wp*epsilon(1.0_wp)
   !> A solution has a residual below this part of the largest term of its equations.
   real(wp), parameter :: accepted = 1.0e6_wp*epsilon(1.0_wp)
   !> Pivots allowed for each unknown, and ways of covering that are tried after the first.
   integer, parameter :: pivots_each = 50, most_ways = 4

   !> I w - M z - e y = q solved for the basic variables: columns w, z and the covering y; `basis` their numbers by row.
   type :: tableau_t
      integer :: n = 0
      real(wp), allocatable :: column(:, :), value(:)
      integer, allocatable :: basis(:)
   end type tableau_t

contains

   !> Solve the problem. `matrix` (n, n), `q` (n); `z` and `w` (n), not negative and exactly complementary, are zero unless
   !> `status` is `complementarity_solved`. `pivots` counts exchanges of a basic variable.
   pure subroutine solve_complementarity(matrix, q, z, w, status, pivots)
      real(wp), intent(in) :: matrix(:, :), q(:)
      real(wp), intent(out) :: z(:), w(:)
      integer, intent(out) :: status, pivots

      type(tableau_t) :: tableau
      real(wp), allocatable :: scaled(:, :)
      real(wp) :: d(size(q)), right(size(q)), size_of_q
      integer :: i, k, n

      n = size(q)
      z = 0.0_wp
      w = 0.0_wp
      pivots = 0
      status = complementarity_not_finite
      if (.not. (all(ieee_is_finite(matrix)) .and. all(ieee_is_finite(q)))) return
      status = complementarity_solved
      if (all(q >= 0.0_wp)) then
         w = q
         return
      end if
      ! Of one body at one stop, most impacts.
      if (n == 1 .and. all(matrix > 0.0_wp)) then
         z = -q/matrix(:, 1)
         return
      end if
      call even_scale(matrix, d)
      scaled = spread(d, 2, n)*matrix*spread(d, 1, n)
      right = d*q
      size_of_q = scale(1.0_wp, exponent(maxval(abs(right))))
      right = right/size_of_q
      ! Where rounding leads astray along one way of covering, it seldom does along another.
      do i = 0, most_ways
         call lemke(tableau, scaled, right, [(1.0_wp + real(i*k, wp)/n, k=1, n)], status, pivots)
         if (status == complementarity_solved) exit
      end do
      if (status /= complementarity_solved) return
      call refine(tableau, scaled, right, z, w)
      if (complementarity_residual(scaled, right, z) > accepted) then
         status = complementarity_inaccurate
         z = 0.0_wp
         w = 0.0_wp
         return
      end if
      z = d*z*size_of_q
      w = w/d*size_of_q
   end subroutine solve_complementarity

   !> The largest of |min(z_i, (M z + q)_i)|, each divided by the largest term of its row, at least 1; z >= 0.
   pure function complementarity_residual(matrix, q, z) result(residual)
      real(wp), intent(in) :: matrix(:, :), q(:), z(:)
      real(wp) :: residual

      real(wp) :: row, largest
      integer :: i

      residual = 0.0_wp
      do i = 1, size(q)
         row = q(i) + dot_product(matrix(i, :), z)
         largest = max(1.0_wp, abs(q(i)), maxval(abs(matrix(i, :)*z)))
         residual = max(residual, abs(min(z(i), row))/largest)
      end do
   end function complementarity_residual

   !> Powers of two `d` (n) with which the largest entry in each row or column of diag(d) M diag(d) is about one.
   pure subroutine even_scale(matrix, d)
      real(wp), intent(in) :: matrix(:, :)
      real(wp), intent(out) :: d(:)

      real(wp) :: both(size(d), size(d)), largest(size(d))
      integer :: i, sweep

      d = 1.0_wp
      both = max(abs(matrix), abs(transpose(matrix)))
      do sweep = 1, 8
         largest = [(d(i)*maxval(both(:, i)*d), i=1, size(d))]
         where (largest > 0.0_wp) d = scale(d, -nint(0.5_wp*exponent(largest)))
      end do
   end subroutine even_scale

   !> Lemke's method with the covering vector e, `along` (n) > 0; on success the basis of `tableau` is complementary.
   pure subroutine lemke(tableau, matrix, q, along, status, pivots)
      type(tableau_t), intent(out) :: tableau
      real(wp), intent(in) :: matrix(:, :), q(:), along(:)
      integer, intent(out) :: status, pivots

      integer :: cover, entering, leaving, n, row, i

      n = size(q)
      cover = 2*n + 1
      tableau%n = n
      allocate (tableau%column(n, cover), source=0.0_wp)
      tableau%column(:, n + 1:2*n) = -matrix
      tableau%column(:, cover) = -along
      tableau%value = q
      allocate (tableau%basis(n))
      do i = 1, n
         tableau%column(i, i) = 1.0_wp
         tableau%basis(i) = i
      end do
      ! Of rows with the same q/e the last is the lexicographic minimum.
      row = n + 1 - minloc(q(n:1:-1)/along(n:1:-1), dim=1)
      entering = cover
      do pivots = 1, pivots_each*(n + 1)
         leaving = tableau%basis(row)
         call pivot(tableau, row, entering)
         status = complementarity_solved
         if (leaving == cover) return
         entering = merge(leaving + n, leaving - n, leaving <= n)
         row = leaving_row(tableau, entering, cover)
         status = complementarity_ray
         if (row == 0) return
      end do
      status = complementarity_pivot_limit
   end subroutine lemke

   !> The row whose variable is the first to reach zero when `entering` grows; 0 if none does. Among equal ones the covering
   !> variable has precedence, as it ends the search, then the lexicographic minimum.
   pure function leaving_row(tableau, entering, cover) result(row)
      type(tableau_t), intent(in) :: tableau
      integer, intent(in) :: entering, cover
      integer :: row

      real(wp) :: ratio(tableau%n), least
      logical :: candidate(tableau%n)
      integer :: k

      row = 0
      associate (column => tableau%column(:, entering))
         candidate = column > negligible*max(maxval(abs(column)), negligible)
         if (.not. any(candidate)) return
         do k = 0, tableau%n
            ratio = huge(1.0_wp)
            if (k == 0) then
               where (candidate) ratio = max(tableau%value, 0.0_wp)/column
            else
               where (candidate) ratio = tableau%column(:, k)/column
            end if
            least = minval(ratio)
            candidate = candidate .and. ratio <= least + negligible*max(1.0_wp, abs(least))
            if (k == 0) then
               row = findloc(tableau%basis == cover .and. candidate, .true., dim=1)
               if (row > 0) return
            end if
            if (count(candidate) == 1) exit
         end do
      end associate
      row = findloc(candidate, .true., dim=1)
   end function leaving_row

   !> Bring the variable `entering` into the basis in place of that of `row`.
   pure subroutine pivot(tableau, row, entering)
      type(tableau_t), intent(inout) :: tableau
      integer, intent(in) :: row, entering

      real(wp) :: column(tableau%n), factor
      integer :: j

      column = tableau%column(:, entering)
      do j = 1, size(tableau%column, 2)
         factor = tableau%column(row, j)/column(row)
         if (.not. abs(factor) > 0.0_wp) cycle
         tableau%column(:, j) = tableau%column(:, j) - factor*column
         tableau%column(row, j) = factor
      end do
      factor = tableau%value(row)/column(row)
      tableau%value = tableau%value - factor*column
      tableau%value(row) = factor
      tableau%basis(row) = entering
   end subroutine pivot

   !> The solution of a complementary basis, improved twice with the inverse that the tableau holds and the matrix given.
   pure subroutine refine(tableau, matrix, q, z, w)
      type(tableau_t), intent(in) :: tableau
      real(wp), intent(in) :: matrix(:, :), q(:)
      real(wp), intent(out) :: z(:), w(:)

      real(wp) :: x(tableau%n), rest(tableau%n)
      integer :: i, n, round

      n = tableau%n
      x = tableau%value
      do round = 1, 3
         z = 0.0_wp
         w = 0.0_wp
         do i = 1, n
            if (tableau%basis(i) <= n) then
               w(tableau%basis(i)) = x(i)
            else
               z(tableau%basis(i) - n) = x(i)
            end if
         end do
         if (round == 3) exit
         rest = q + matmul(matrix, z) - w
         x = x + matmul(tableau%column(:, :n), rest)
      end do
      z = max(z, 0.0_wp)
      w = max(w, 0.0_wp)
   end subroutine refine

end module razy_linalg_complementarity_lemke
