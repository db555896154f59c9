!! The symmetric eigenproblem K x = lambda M x with M positive definite, K positive semidefinite: all of it or its lowest end.
!!
!! Small problems go to LAPACK (dgejsv). Of large sparse ones the lowest eigenpairs are found by ARPACK in shift-invert mode on
!! the banded Cholesky factor of K - shift M; a negative shift makes that positive definite also where K has rigid-body modes.
!! A Lanczos method can miss copies of a multiple eigenvalue. So the number of eigenvalues below the last one is counted
!! by Sylvester's law of inertia, and what is missing is looked for again, orthogonal to what was found.
module razy_linalg_generalised
   use, intrinsic :: ieee_exceptions, only: ieee_all, ieee_get_halting_mode, ieee_set_halting_mode
   use razy_core_kinds, only: wp
   use razy_linalg_band_matrix, only: negative_eigenvalues
   use razy_linalg_banded, only: band_factor_t
   use razy_linalg_dense, only: make_orthonormal, rising_order
   use razy_linalg_lapack, only: dgejsv, dpotrf, dsaupd, dseupd, dtrsm
   use razy_linalg_pattern, only: connected_sets
   use razy_linalg_sparse, only: add_matrices, csr_t
   implicit none(type, external)
   private

   public :: dense_modes, eigenpairs_t, first_modes, keep_first, lowest_modes, orient
   public :: modes_found, modes_failed, modes_not_definite, modes_not_converged, modes_missing

   !> Outcomes are found; LAPACK or ARPACK failed; K - shift M or M is not positive definite; no convergence; fewer than the
   !> count by inertia.
   integer, parameter :: modes_found = 0, modes_failed = 1, modes_not_definite = 2, modes_not_converged = 3, modes_missing = 4
   !> Problems of at most this size, or of which more than a third of all pairs is wanted, go to LAPACK.
   integer, parameter :: most_dense = 300
   !> Restarts of the Lanczos method, and searches for what was missed.
   integer, parameter :: most_restarts = 300, most_searches = 10
   !> Eigenvalues that differ less, relatively, are copies when a gap for the count is looked for.
   real(wp), parameter :: copy = 1.0e-6_wp

   !> Eigenpairs in ascending order; vectors (n, pairs) with xᵀ M x = 1 and their largest component positive.
   type :: eigenpairs_t
      integer :: status = modes_found
      real(wp), allocatable :: value(:), vector(:, :)
      !> Searches, 1 unless copies were missed; 0 where LAPACK served.
      integer :: searches = 0
   end type eigenpairs_t

contains

   !> All eigenpairs by LAPACK. `stiffness`, `mass` (n, n). What no entry couples is solved apart, as the planes in which a shaft
   !> bends, and stands in the order of its coordinates where values are the same but for rounding. So vectors of copies change
   !> with the matrices and not by rounding.
   function dense_modes(stiffness, mass) result(pairs)
      real(wp), contiguous, intent(in) :: stiffness(:, :), mass(:, :)
      type(eigenpairs_t) :: pairs

      type(eigenpairs_t) :: part
      real(wp), allocatable :: value(:), vector(:, :)
      integer, allocatable :: members(:), order(:)
      integer :: i, k, last, n, set(size(mass, 1))
      real(wp) :: rounding(size(mass, 1))

      n = size(mass, 1)
      set = connected_sets(abs(stiffness) > 0.0_wp .or. abs(mass) > 0.0_wp)
      allocate (value(n))
      allocate (vector(n, n), source=0.0_wp)
      last = 0
      do k = 1, maxval(set)
         members = pack([(i, i=1, n)], set == k)
         part = connected_modes(stiffness(members, members), mass(members, members))
         pairs%status = max(pairs%status, part%status)
         value(last + 1:last + size(members)) = part%value
         rounding(last + 1:last + size(members)) = rounding_of(stiffness(members, members), part%vector)
         vector(members, last + 1:last + size(members)) = part%vector
         last = last + size(members)
      end do
      order = rising_order(value)
      do i = 2, n
         do k = i, 2, -1
            if (order(k - 1) < order(k) .or. .not. are_copies(value(order(k - 1:k)), rounding(order(k - 1:k)))) exit
            order(k - 1:k) = order([k, k - 1])
         end do
      end do
      pairs%value = value(order)
      pairs%vector = vector(:, order)
      call orient(pairs%vector)
   end function dense_modes

   !> The same of matrices whose rows are all coupled. Vectors of copies are as near as can be to fixed ones.
   function connected_modes(stiffness, mass) result(pairs)
      real(wp), contiguous, intent(in) :: stiffness(:, :), mass(:, :)
      type(eigenpairs_t) :: pairs

      real(wp), allocatable :: factor(:, :), rounding(:)
      integer :: first, i, info, last, n

      n = size(mass, 1)
      call jacobi_modes(pairs, stiffness, mass, info)
      if (info == 0) rounding = rounding_of(stiffness, pairs%vector)
      first = 1
      do while (info == 0 .and. first < n)
         last = first
         do while (last < n)
            if (.not. are_copies(pairs%value(last:last + 1), rounding(last:last + 1))) exit
            last = last + 1
         end do
         if (last > first) then
            associate (copies => pairs%vector(:, first:last))
               factor = copies
               do i = 1, size(copies, 2)
                  call start_vector(factor(:, i), i)
               end do
               factor = matmul(copies, matmul(transpose(matmul(mass, copies)), factor))
               call make_orthonormal(factor, mass)
               copies = factor
            end associate
         end if
         first = last + 1
      end do
   end function connected_modes

   !> The same, whatever copies there are, from the singular values of R L⁻ᵀ, K + s M = Rᵀ R and M = L Lᵀ: eigenvalues as small
   !> as those of disks beside those of a shaft of hardly any mass keep their digits, which K in the metric of M does not have.
   !> s is 0, or as small as rounding and springs of negative stiffness allow. `info` is 0 if all are found.
   subroutine jacobi_modes(pairs, stiffness, mass, info)
      type(eigenpairs_t), intent(inout) :: pairs
      real(wp), intent(in) :: stiffness(:, :), mass(:, :)
      integer, intent(out) :: info

      real(wp) :: left(1, 1), shift
      real(wp), allocatable :: factor(:, :), form(:, :), work(:)
      integer, allocatable :: iwork(:)
      integer :: j, n
      logical :: halting(size(ieee_all))

      n = size(mass, 1)
      allocate (pairs%value(n), source=0.0_wp)
      allocate (pairs%vector(n, n), source=0.0_wp)
      allocate (work(7 + 68*n + n*n), iwork(3 + n))
      factor = mass
      call dpotrf("U", n, factor, n, info)
      if (info /= 0) pairs%status = modes_not_definite
      if (info /= 0) return
      shift = 0.0_wp
      do
         form = stiffness + shift*mass
         call dpotrf("U", n, form, n, info)
         if (info == 0) exit
         ! What is no number stays so, whatever is added.
         if (.not. shift < sqrt(huge(shift))) pairs%status = modes_failed
         if (pairs%status == modes_failed) return
         shift = max(10*shift, n*epsilon(shift)*maxval(abs(stiffness))/maxval(abs(mass)), sqrt(tiny(shift)))
      end do
      do j = 1, n
         form(j + 1:, j) = 0.0_wp
      end do
      call dtrsm("R", "U", "N", "N", n, n, 1.0_wp, factor, n, form, n)
      ! Bounds of what is neither too large nor too small overflow inside LAPACK by design.
      call ieee_get_halting_mode(ieee_all, halting)
      call ieee_set_halting_mode(ieee_all, .false.)
      call dgejsv("C", "N", "V", "N", "N", "N", n, n, form, n, pairs%value, left, 1, pairs%vector, n, work, size(work), iwork, info)
      call ieee_set_halting_mode(ieee_all, halting)
      if (info /= 0) pairs%status = modes_failed
      call dtrsm("L", "U", "N", "N", n, n, 1.0_wp, factor, n, pairs%vector, n)
      pairs%value = (work(1)/work(2)*pairs%value(n:1:-1))**2 - shift
      where (abs(pairs%value) <= n*epsilon(shift)*shift) pairs%value = 0.0_wp
      pairs%vector = pairs%vector(:, n:1:-1)
   end subroutine jacobi_modes

   !> What rounding of K (n, n) leaves in the eigenvalues of vectors (n, m).
   pure function rounding_of(stiffness, vector) result(rounding)
      real(wp), intent(in) :: stiffness(:, :), vector(:, :)
      real(wp), allocatable :: rounding(:)

      rounding = 4*size(vector, 1)*epsilon(1.0_wp)*sum(abs(vector)*matmul(abs(stiffness), abs(vector)), dim=1)
   end function rounding_of

   !> Whether two eigenvalues differ by no more than their `rounding`, which of soft modes on stiff meshes may be more than what is
   !> between them: these are not mixed.
   pure logical function are_copies(two, rounding)
      real(wp), intent(in) :: two(2), rounding(2)

      real(wp), parameter :: close = 1.0e-3_wp

      associate (larger => maxval(abs(two)), error => maxval(rounding))
         are_copies = abs(two(2) - two(1)) <= max(min(error, close*larger), merge(error, 0.0_wp, larger <= error))
      end associate
   end function are_copies

   !> The `count` lowest eigenpairs, or all if there are fewer, of sparse K and M: by LAPACK if these are small or much of them is
   !> wanted, else as `lowest_modes`.
   function first_modes(stiffness, mass, count, shift) result(pairs)
      type(csr_t), intent(in) :: stiffness, mass
      integer, intent(in) :: count
      real(wp), intent(in) :: shift
      type(eigenpairs_t) :: pairs

      if (mass%rows > most_dense .and. 3*count <= mass%rows) then
         pairs = lowest_modes(stiffness, mass, count, shift)
      else
         pairs = dense_modes(stiffness%dense(), mass%dense())
         if (pairs%status == modes_found .and. count < mass%rows) call keep_first(pairs, count)
      end if
   end function first_modes

   !> The `count` lowest eigenpairs of sparse K and M by ARPACK. `shift` < 0, or 0 where K is positive definite; it should be of the
   !> size of the lowest eigenvalues that are not zero. `count` is less than n.
   function lowest_modes(stiffness, mass, count, shift) result(pairs)
      type(csr_t), intent(in) :: stiffness, mass
      integer, intent(in) :: count
      real(wp), intent(in) :: shift
      type(eigenpairs_t) :: pairs

      type(band_factor_t) :: factor
      real(wp) :: gap
      integer :: below, info, wanted

      allocate (pairs%value(0), pairs%vector(mass%rows, 0))
      call factor%factor(add_matrices(1.0_wp, stiffness, -shift, mass), info)
      if (info /= 0) pairs%status = modes_not_definite
      ! One more than asked for, to have a gap above the last.
      wanted = min(count + 1, mass%rows - 1)
      do while (pairs%status == modes_found .and. wanted > 0)
         if (pairs%searches == most_searches) then
            pairs%status = modes_missing
            exit
         end if
         call find_more(pairs, mass, factor, shift, wanted)
         if (pairs%status /= modes_found) exit
         call find_gap(pairs%value, count, gap, below)
         if (below == 0) exit
         wanted = negative_eigenvalues(add_matrices(1.0_wp, stiffness, -gap, mass)) - below
      end do
      if (size(pairs%value) > count) call keep_first(pairs, count)
      call orient(pairs%vector)
   end function lowest_modes

   !> The highest gap among the first `count` + 1 values that is no gap between copies: a number in it, and the number of
   !> values below; 0 if there is none.
   pure subroutine find_gap(value, count, gap, below)
      real(wp), intent(in) :: value(:)
      integer, intent(in) :: count
      real(wp), intent(out) :: gap
      integer, intent(out) :: below

      gap = 0.0_wp
      do below = min(count, size(value) - 1), 1, -1
         if (value(below + 1) - value(below) > copy*maxval(abs(value(:below + 1)))) then
            gap = 0.5_wp*(value(below) + value(below + 1))
            return
         end if
      end do
   end subroutine find_gap

   !> Add the `wanted` lowest eigenpairs that are orthogonal to `pairs`, by the implicitly restarted Lanczos method in shift-invert
   !> mode; `factor` is that of K - shift M.
   subroutine find_more(pairs, mass, factor, shift, wanted)
      type(eigenpairs_t), intent(inout) :: pairs
      type(csr_t), intent(in) :: mass
      type(band_factor_t), intent(in) :: factor
      real(wp), intent(in) :: shift
      integer, intent(in) :: wanted

      real(wp), allocatable :: basis(:, :), image(:, :), residual(:), value(:), vector(:, :), workd(:, :), workl(:)
      logical, allocatable :: select(:)
      real(wp) :: tolerance
      integer :: ido, info, iparam(11), ipntr(11), j, known, n, width

      n = mass%rows
      known = size(pairs%value)
      width = min(n, max(2*wanted + 1, 20))
      allocate (basis(n, width), residual(n), workd(n, 3), workl(width*(width + 8)), select(width))
      allocate (image(n, known), value(wanted), vector(n, known + wanted))
      do j = 1, known
         call mass%multiply(pairs%vector(:, j), image(:, j))
      end do
      call start_vector(residual)
      call remove_known(pairs%vector, image, residual)
      iparam = 0
      iparam([1, 3, 7]) = [1, most_restarts, 3]
      ipntr = 0
      tolerance = 0.0_wp
      ido = 0
      info = 1
      pairs%searches = pairs%searches + 1
      do
         call dsaupd(ido, "G", n, "LM", wanted, tolerance, residual, width, basis, n, iparam, ipntr, workd, workl, &
                     size(workl), info)
         if (abs(ido) /= 1 .and. ido /= 2) exit
         associate (x => workd(:, 1 + ipntr(1)/n), y => workd(:, 1 + ipntr(2)/n))
            if (ido == 2) then
               call mass%multiply(x, y)
            else
               if (ido == 1) then
                  y = factor%solve(workd(:, 1 + ipntr(3)/n))
               else
                  y = factor%solve(mass%times(x))
               end if
               call remove_known(pairs%vector, image, y)
            end if
         end associate
      end do
      if (info == 0 .and. iparam(5) >= wanted) then
         call dseupd(.true., "A", select, value, basis, n, shift, "G", n, "LM", wanted, tolerance, residual, &
                     width, basis, n, iparam, ipntr, workd, workl, size(workl), info)
         if (info /= 0) pairs%status = modes_failed
      else
         pairs%status = merge(modes_not_converged, modes_failed, info == 0 .or. info == 1 .or. info == 3)
      end if
      if (pairs%status /= modes_found) return
      value = [pairs%value, value]
      vector(:, :known) = pairs%vector
      vector(:, known + 1:) = basis(:, :wanted)
      associate (order => rising_order(value))
         pairs%value = value(order)
         pairs%vector = vector(:, order)
      end associate
   end subroutine find_more

   !> x - X Xᵀ M x for the pairs X found already (deflation), with `image` M X, twice, because once leaves rounding behind.
   pure subroutine remove_known(vector, image, x)
      real(wp), intent(in) :: vector(:, :), image(:, :)
      real(wp), intent(inout) :: x(:)

      integer :: pass

      if (size(vector, 2) == 0) return
      do pass = 1, 2
         x = x - matmul(vector, matmul(x, image))
      end do
   end subroutine remove_known

   !> Numbers in [-1, 1] without pattern, the same in every call with this `number`: a linear congruential generator (Park and
   !> Miller, 1988).
   pure subroutine start_vector(x, number)
      real(wp), intent(out) :: x(:)
      integer, intent(in), optional :: number

      integer, parameter :: modulus = 2147483647, factor = 16807, quotient = 127773, remainder = 2836
      integer :: i, state

      state = 20261
      if (present(number)) state = state + number
      do i = 1, size(x)
         state = factor*mod(state, quotient) - remainder*(state/quotient)
         if (state <= 0) state = state + modulus
         x(i) = 2*real(state, wp)/modulus - 1
      end do
   end subroutine start_vector

   !> Keep the `count` lowest pairs.
   subroutine keep_first(pairs, count)
      type(eigenpairs_t), intent(inout) :: pairs
      integer, intent(in) :: count

      pairs%value = pairs%value(:count)
      pairs%vector = pairs%vector(:, :count)
   end subroutine keep_first

   !> Make the first of the largest components of each vector positive, so that signs do not depend on the method: of the vector
   !> itself, or of what it stands for (`meaning`, as many columns).
   pure subroutine orient(vector, meaning)
      real(wp), intent(inout) :: vector(:, :)
      real(wp), intent(in), optional :: meaning(:, :)

      integer :: j
      logical :: turn

      do j = 1, size(vector, 2)
         if (present(meaning)) then
            turn = points_down(meaning(:, j))
         else
            turn = points_down(vector(:, j))
         end if
         if (turn) vector(:, j) = -vector(:, j)
      end do
   end subroutine orient

   !> Whether the first of the largest components is negative.
   pure logical function points_down(vector)
      real(wp), intent(in) :: vector(:)

      points_down = vector(findloc(abs(vector) >= (1 - copy)*maxval(abs(vector)), .true., 1)) < 0.0_wp
   end function points_down

end module razy_linalg_generalised
